#include "sim/core/rotation.h"

#include <Eigen/Geometry>

namespace touchfield {

Eigen::Matrix3d extrinsic_rotation(const Vector3& angles) {
  return (Eigen::AngleAxisd(angles.z(), Vector3::UnitZ()) * Eigen::AngleAxisd(angles.y(), Vector3::UnitY()) *
          Eigen::AngleAxisd(angles.x(), Vector3::UnitX()))
      .toRotationMatrix();
}

}  // namespace touchfield
