#pragma once

#include <numbers>
#include <random>

#include <Eigen/Geometry>

#include "sim/core/types.h"

namespace touchfield {

/// From the generator's bits, the same with every standard library.
inline double uniform(std::mt19937& random, double least, double most) {
  return least + (most - least) * static_cast<double>(random()) / 0x1p32;
}

/// In -1..1 along each axis.
inline Vector3 point_in_cube(std::mt19937& random) {
  return {uniform(random, -1, 1), uniform(random, -1, 1), uniform(random, -1, 1)};
}

inline Eigen::Matrix3d some_rotation(std::mt19937& random) {
  return Eigen::AngleAxisd(uniform(random, 0, 2 * std::numbers::pi), point_in_cube(random).normalized())
      .toRotationMatrix();
}

}  // namespace touchfield
