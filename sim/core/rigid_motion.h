#pragma once

#include "sim/core/types.h"

namespace touchfield {

/// x -> rotation x + shift.
struct RigidMotion {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Vector3 shift = Vector3::Zero();  // [m]

  Vector3 operator()(const Vector3& x) const { return rotation * x + shift; }
  Points operator()(const Points& points) const { return (rotation * points).colwise() + shift; }
};

}  // namespace touchfield
