#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
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

/// Finds the nodes of a grid that are inside a soup of faces, where its winding number w is above 1/2. It also finds
/// where the grid's edges leave the inside.
///
/// w is computed at the ends of the grid's edges that a face crosses. From there the computation continues where w
/// passes 1/2 without a face (across holes). Elsewhere a node is on the side of the node before it. Parts of one node's
/// thickness are dropped. Gaps of one node's width between two nodes inside are filled. The rest is wider than a
/// spacing.
class InsideGrid {
 public:
  /// soup      any faces, seen from outside
  /// spacing   of the nodes [m], > 0; the grid takes two bytes per node, and 16 per edge of it that a face crosses
  InsideGrid(const TriangleMesh& soup, double spacing);

  /// The boundary of the inside: closed, manifold, oriented outwards. Cavities have walls of their own, which face into
  /// them. Vertices lie on the grid's edges. Where w passes 1/2 on a face, the vertex is on the face. Elsewhere it is
  /// where w is 1/2, to a thousandth of the spacing. Next to a node that was dropped or filled, it is a tenth of the
  /// spacing from that node. Between two such nodes it is in the middle. Empty if no node is inside.
  Isosurface surface() const;

  /// Nodes dropped and filled.
  std::size_t dropped() const { return dropped_; }
  std::size_t filled() const { return filled_; }

 private:
  struct Crossing {  // of an edge of the grid by a face
    std::uint64_t edge;
    float at;  // 0..1 along it
    bool operator<(const Crossing& other) const { return edge != other.edge ? edge < other.edge : at < other.at; }
  };

  std::uint64_t edge(std::size_t node, int axis) const {
    return 3 * static_cast<std::uint64_t>(node) + static_cast<std::uint64_t>(axis);
  }
  std::array<int, 3> place(std::size_t node) const;
  Vector3 point(std::size_t node) const;
  double winding_along(std::size_t node, int axis, double at) const;

  void find_crossings(const TriangleMesh& soup);
  std::vector<std::size_t> sample(std::vector<std::size_t> nodes);
  std::vector<std::size_t> about_soft_edges(const std::vector<std::size_t>& fresh) const;
  std::vector<std::size_t> about_open_edges() const;
  void fill_rows();
  std::size_t turn_thin(bool are_inside);
  void part_crossed_sides();
  template <class Visit>
  void for_each_inner_node(const Visit& visit) const;
  double crossing(std::size_t node, int axis) const;

  FaceTree tree_;
  NodeGrid grid_;
  std::array<std::size_t, 3> stride_{};
  std::vector<Crossing> crossings_;  // in order
  std::vector<signed char> sides_;   // of the nodes: negative inside
  std::size_t dropped_ = 0;
  std::size_t filled_ = 0;
};

}  // namespace touchfield
