#pragma once

#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

/// Corners of a triangle as columns [m].
using Corners = Eigen::Matrix3d;

inline Corners corners(const TriangleMesh& mesh, Eigen::Index f) {
  Corners result;
  result << mesh.corner(f, 0), mesh.corner(f, 1), mesh.corner(f, 2);
  return result;
}

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

}  // namespace touchfield
