#pragma once

#include <functional>

#include "sim/mesh/cut/clip_mesh.h"

namespace touchfield {

/// A plane, or a sphere without one point, mapped to the plane without distorting angles. A loop that is
/// counter-clockwise seen from the side that the caps face is counter-clockwise in the plane too.
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

/// Gives caps nearly equilateral faces, by adding points of the chart's surface. Next to a rim the caps' edges are as
/// long as those of the rim. From there they grow to the wanted length. Rims stay.
///
/// surface      closed
/// skin_faces   the number of its first faces, which are not caps
/// edge         wanted length at a point [m], > 0
/// throws       InputError if an edge does not have two faces that run opposite ways
void refine_caps(ClippedSurface& surface, Eigen::Index skin_faces, const CapChart& chart,
                 const std::function<double(const Vector3&)>& edge);

}  // namespace touchfield
