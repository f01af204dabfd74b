#pragma once

#include <optional>

#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

/// The convex hull of points in a plane, as triangles round one of its corners (facing either way).
///
/// points   3 x N [m], in the plane that fits them best
/// flat     how far they may be from it [m]
/// returns  nothing if they are farther, fewer than three, or not wider than a thousandth of their length
std::optional<TriangleMesh> flat_hull(const Points& points, double flat);

}  // namespace touchfield
