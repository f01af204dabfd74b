#pragma once

#include <functional>

#include "sim/mesh/cut/clip_mesh.h"

namespace touchfield {

/// A plane, or a sphere but for one point, spread out in the plane without distorting angles: a counter-clockwise loop
/// seen from the side that the caps look to is one in the plane.
struct CapChart {
  std::function<Eigen::Vector2d(const Vector3&)> to_plane;  // of a point of space by the nearest point of the surface
  std::function<Vector3(const Eigen::Vector2d&)> to_space;

  /// The nearest point of the surface.
  Vector3 onto(const Vector3& x) const { return to_space(to_plane(x)); }
};

/// Closes an open surface whose rims lie on the chart's, by faces between the rims' points, appended to its triangles.
/// A cap may have any number of rims.
///
/// throws   InputError if the rims cross or touch each other, or do not bound an inside
void add_caps(ClippedSurface& surface, const CapChart& chart);

/// Gives caps nearly equilateral faces, by points of the chart's surface: their edges are as long as those of the rims
/// there and from there grow to those asked for. Rims stay.
///
/// surface      closed
/// skin_faces   the number of its first faces, that are no caps
/// edge         wanted length at a point [m], > 0
/// throws       InputError if an edge does not have two faces that run opposite ways
void refine_caps(ClippedSurface& surface, Eigen::Index skin_faces, const CapChart& chart,
                 const std::function<double(const Vector3&)>& edge);

}  // namespace touchfield
