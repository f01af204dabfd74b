#pragma once

#include <Eigen/Geometry>

#include "sim/core/types.h"

namespace touchfield {

/// x -> rotation x + shift.
struct RigidMotion {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Vector3 shift = Vector3::Zero();  // [m]

  Vector3 operator()(const Vector3& x) const { return rotation * x + shift; }
  Points operator()(const Points& points) const { return (rotation * points).colwise() + shift; }
};

/// Rotation matrix R = Rz Ry Rx: extrinsic rotations about the fixed x, then y, then z axis.
///
/// angles   about x, y, z [rad]
inline Eigen::Matrix3d extrinsic_rotation(const Vector3& angles) {
  return (Eigen::AngleAxisd(angles.z(), Vector3::UnitZ()) * Eigen::AngleAxisd(angles.y(), Vector3::UnitY()) *
          Eigen::AngleAxisd(angles.x(), Vector3::UnitX()))
      .toRotationMatrix();
}

}  // namespace touchfield
