#pragma once

#include <functional>

#include "sim/mesh/query/face_tree.h"
#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

/// Distances of the points of one surface from another [m].
struct SurfaceDistance {
  double counted = 0;            // share of the surface's area whose points were asked for, 0..1
  double most_of_it = 0;         // 95 % of that area is nearer
  double farthest = 0;           // at the points asked
  Vector3 at = Vector3::Zero();  // the farthest point [m]
};

/// From the points of a surface to the nearest of another. Each face is cut into equal triangles with sides of at most
/// `spacing`; their centroids are asked, weighted by area: exact distances at those points.
///
/// from      any triangles
/// to        of the other surface
/// spacing   [m], > 0; larger where that would make more than a million points
/// counts    whether a point, of a face with this unit normal, counts; asked from several threads at once
SurfaceDistance surface_distance(const TriangleMesh& from, const FaceTree& to, double spacing,
                                 const std::function<bool(const Vector3& x, const Vector3& normal)>& counts);

}  // namespace touchfield
