#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "sim/mesh/query/face_tree.h"
#include "sim/mesh/remesh/isosurface.h"
#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

/// A point is inside where the winding number is above this.
inline constexpr double kInsideAbove = 0.5;

/// Nodes of the grid that InsideGrid takes about a surface: its box and two spacings on every side.
///
/// box       its sides [m]
/// spacing   [m], > 0
double node_count(const Vector3& box, double spacing);

/// The nodes of a grid that are inside a soup of faces, where its winding number w is above 1/2. Boxes of nodes that no
/// face reaches and in whose middle w is not near 1/2 are on one side; others are halved down to single nodes. Then
/// parts of one node's thickness are dropped, and gaps of one node's width between two nodes inside are filled. The
/// rest is wider than a spacing.
class InsideGrid {
 public:
  /// soup      any faces, seen from outside
  /// spacing   of the nodes [m], > 0; the grid takes a byte per node
  InsideGrid(const TriangleMesh& soup, double spacing);

  /// The boundary of the inside: closed, manifold, oriented outwards. Cavities have walls of their own, which face into
  /// them. Vertices lie on the grid's edges where w passes 1/2, to a hundredth of the spacing. Next to a node that was
  /// dropped or filled, a vertex is a tenth of the spacing from that node. Between two such nodes it is in the middle.
  /// Empty if no node is inside.
  Isosurface surface() const;

 private:
  using Node = std::array<int, 3>;

  Vector3 point(const Node& node) const { return grid_.origin + grid_.spacing * Vector3(node[0], node[1], node[2]); }
  bool is_inside(const Vector3& x) const { return tree_.winding_number(x) > kInsideAbove; }
  void sample(const Node& first, int side);
  void turn_thin(bool are_inside);
  void part_crossed_sides();
  template <class Visit>
  void for_each_inner_node(const Visit& visit) const;
  double crossing(const Node& node, std::size_t axis) const;

  TriangleMesh soup_;
  FaceTree tree_;
  NodeGrid grid_;
  std::array<std::size_t, 3> stride_{};
  std::vector<signed char> sides_;  // of the nodes: negative inside
};

}  // namespace touchfield
