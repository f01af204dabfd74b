#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "sim/mesh/io/mesh_files.h"
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

/// Distances of the points of one surface from another [m]. The points are the middles of its faces, cut until none has
/// an edge longer than the skin's, weighted by area.
struct SurfaceDistance {
  double counted = 0;            // share of the surface's area whose points were asked for, 0..1
  double most_of_it = 0;         // 95 % of that area is nearer
  double farthest = 0;           // at the points asked
  Vector3 at = Vector3::Zero();  // the farthest point [m]
};

/// A surface with new faces.
struct Resurfaced {
  TriangleMesh mesh;      // the new skin
  TriangleMesh original;  // the faces that it was made of, see oriented_soup()
  /// From the original's outer faces to the skin, and back. Outer is what has w < 0.3 before it and w > 0.7 behind it:
  /// faces inside the body, flaps and the rims of holes are not.
  SurfaceDistance to_skin;
  SurfaceDistance from_skin;       // all of the skin: over a hole there is no original
  std::vector<std::string> steps;  // what was done, a line each, with the figures above
};

/// Refuses, before anything large is begun, an edge too short for the memory and the faces that are allowed.
///
/// throws   InputError if the edge is not > 0 and finite, or the grid would have more than 300 million nodes (0.3 GiB)
///          or the surface more than 5 million faces
void require_resurfaceable(const FileSurface& surface, double unit, double edge, const std::string& name,
                           const std::string& field);

/// One closed skin from any soup of faces: holes, flaps, crossings, duplicates, nested and overlapping parts. A point
/// is inside where the generalised winding number
///
///   w(x) = sum over faces of their solid angle seen from x, signed, over 4 pi
///
/// is above 1/2. It is 1 in a closed surface. It is 2 where two surfaces overlap, so that these become one volume.
/// Holes are closed by the surface w = 1/2 through their rims, a flat hole by about its plane. w is computed on a grid
/// of half the edge (InsideGrid). Its surface is remeshed to the edge (surface_remesh.h) without creases. Edges
/// sharper than the new faces are rounded by about a quarter of an edge. Cavities and pieces inside others are filled.
/// Gaps narrower than half an edge to an edge close, and parts thinner than that vanish. Pieces smaller than a cube of
/// the edge vanish too.
///
/// surface    as read
/// unit       metres per file unit, > 0
/// edge       of the new faces [m]
/// name       how messages call the surface, e.g. its file
/// field      how messages call the edge, e.g. "--resurface"
/// returns    the skin: closed, manifold, oriented outwards, without faces that cut each other; edges of the length
///            asked for as remeshing makes them
/// throws     InputError as require_resurfaceable, before memory is taken; if there is no volume; if the edge is too
///            long: nothing is left, or 5 % of the outer faces are farther than an edge from the skin
///            NumericalError if the resulting skin cuts itself
/// source     Jacobson, Kavan and Sorkine-Hornung, Robust inside-outside segmentation using generalized winding
///            numbers, ACM Trans. Graph. 32 (2013) 33; face_tree.h computes w
Resurfaced resurfaced(const FileSurface& surface, double unit, double edge, const std::string& name,
                      const std::string& field);

}  // namespace touchfield
