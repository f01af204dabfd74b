#pragma once

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "sim/mesh/face_shape.h"
#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

double longest_edge(const Corners& triangle);  // [m]

/// Overlap up to which two triangles only touch, over the longest edge of both.
inline constexpr double kTouch = 1e-9;

/// Whether the insides (the triangles less their edges) of two triangles meet. If they do not meet, a plane that does
/// not hold both triangles separates them. Its normal is one of 17 axes: the two normals, the nine products of two
/// edges, and the six normals of edges within a triangle's plane. The last six serve triangles in one plane. Triangles
/// only touch if along one axis they are apart or overlap by at most kTouch. An axis along which both together are no
/// wider than kTouch does not count: the triangles then lie in one plane across it. A shared edge or corner is an
/// overlap of 0 like any other, so neighbours need no rule of their own.
bool cut_each_other(const Corners& a, const Corners& b);

/// Two points of two triangles, the nearest ones if nothing else is said.
struct PointPair {
  Vector3 on_a;
  Vector3 on_b;
  double squared;  // distance [m2]
};

/// The nearest points of two triangles; where these cut, a common point of an edge of one and the other, or of two
/// edges. Exact but for rounding, and for 1e-8 of an edge where edges are parallel to as much.
PointPair nearest_points(const Corners& a, const Corners& b);

/// Pairs of faces of a mesh that cut each other, each pair once, the lower face first, in order. Faces that share an
/// edge or a vertex count only if they overlap beyond it. They are then folded onto each other, or one pierces the
/// other. Faces that only touch (within 1e-9 of the longest edge of both) do not count. Faces in one plane, to the same
/// tolerance, count if they overlap in it. A skin that goes through another only along edges of both, to 1e-9, is not
/// detected.
///
/// mesh      open or closed
/// most      stops after so many pairs; those found do not depend on the number of threads
/// accuracy  decided in double precision; a million faces of a closed skin take some seconds on one core
std::vector<std::pair<Eigen::Index, Eigen::Index>> self_intersections(const TriangleMesh& mesh,
                                                                      std::size_t most = 1000);

/// "3 pairs of faces intersect, the first near (..) mm", from the pairs that self_intersections found; empty if there
/// are none.
std::string self_intersections_text(const TriangleMesh& mesh,
                                    const std::vector<std::pair<Eigen::Index, Eigen::Index>>& pairs, std::size_t most);

/// Pairs (face of one, face of other) of two meshes that cut each other, in order; the same rules.
std::vector<std::pair<Eigen::Index, Eigen::Index>> intersections(const TriangleMesh& one, const TriangleMesh& other,
                                                                 std::size_t most = 1000);

}  // namespace touchfield
