#pragma once

#include <Eigen/Geometry>

#include "sim/core/types.h"

namespace touchfield {

/// Rotation matrix R = Rz Ry Rx: extrinsic rotations about the fixed x, then y, then z axis.
///
/// angles   about x, y, z [rad]
inline Eigen::Matrix3d extrinsic_rotation(const Vector3& angles) {
  return (Eigen::AngleAxisd(angles.z(), Vector3::UnitZ()) * Eigen::AngleAxisd(angles.y(), Vector3::UnitY()) *
          Eigen::AngleAxisd(angles.x(), Vector3::UnitX()))
      .toRotationMatrix();
}

}  // namespace touchfield
