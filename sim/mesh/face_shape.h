#pragma once

#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

/// (b - a) x (c - a) of the face abc: along its normal, twice its area long [m2].
Vector3 twice_area_vector(const Points& points, const Eigen::Vector3i& face);

/// Whether a face has no area to speak of: below `least` of its longest edge squared. The default is TriangleMesh's
/// own limit: a face that is flat by it has no place in one.
bool is_flat(const Points& points, const Eigen::Vector3i& face, double least = 1e-12);

}  // namespace touchfield
