#pragma once

#include "sim/core/types.h"

namespace touchfield {

/// Rotation matrix R = Rz Ry Rx: extrinsic rotations about the fixed x, then y, then z axis.
///
/// angles   about x, y, z [rad]
Eigen::Matrix3d extrinsic_rotation(const Vector3& angles);

}  // namespace touchfield
