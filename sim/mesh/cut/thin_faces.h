#pragma once

#include <functional>
#include <vector>

#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

/// A closed surface in two parts, a skin and its caps, which meet in rims.
struct CappedSurface {
  Points points;
  Triangles triangles;
  std::vector<bool> is_cap;    // of each face
  std::vector<bool> is_fixed;  // of each point: stays
  /// How far a point of a crease or of a bend of the rim may move at a place [m].
  std::function<double(const Vector3&)> tolerance;
};

/// Removes faces with angles below 25 degrees as far as collapsing and flipping edges can: rims and
/// creases (above 50 degrees) stay within the tolerance, no face turns by more than 37 degrees, and no
/// change makes the smallest angle round it smaller.
///
/// throws   InputError if the surface is not a closed oriented manifold
void remove_thin_faces(CappedSurface& surface);

/// The smallest angle of a triangle [rad].
double smallest_angle(const Vector3& a, const Vector3& b, const Vector3& c);

}  // namespace touchfield
