#pragma once

#include <array>
#include <string>

#include "sim/core/types.h"

namespace touchfield {

/// A regular grid of points, x fastest. A plane has one count of 1.
struct FieldGrid {
  std::string name;
  Vector3 origin;            // the first point [m]
  Vector3 spacing;           // [m]
  std::array<int, 3> count;  // points along x, y, z

  Eigen::Index size() const { return static_cast<Eigen::Index>(count[0]) * count[1] * count[2]; }
  /// 3 x size() [m]
  Points points() const;
};

/// Points centre - size/2 ... centre + size/2 at most `spacing` apart on each axis; an axis of size 0 has one point.
FieldGrid centred_grid(const std::string& name, const Vector3& centre, const Vector3& size, double spacing);

}  // namespace touchfield
