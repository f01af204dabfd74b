#pragma once

#include "sim/core/types.h"

namespace touchfield {

/// A pinhole or orthographic camera. Columns of its image count from the left, rows from the top; the middle of pixel
/// (i, j) is at u = i + 0.5, v = j + 0.5.
///
/// A point x [m] has the camera's coordinates (X, Y, Z) = axes^T (x - eye) [m] and is seen at
///   pinhole        u = centre_u + focal_u X / Z, v = centre_v + focal_v Y / Z
///   orthographic   u = centre_u + focal_u X,     v = centre_v + focal_v Y
/// if Z, its depth, is at least `near`.
struct Camera {
  enum class Projection { kPinhole, kOrthographic };

  Projection projection = Projection::kPinhole;
  int width = 0;   // [pixels], 1 to 16384
  int height = 0;  // [pixels], 1 to 16384
  Vector3 eye = Vector3::Zero();
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();  // columns: right, down, forward; a rotation
  Eigen::Vector2d focal = Eigen::Vector2d::Zero();     // > 0; pinhole [pixels], orthographic [pixels a metre]
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();    // where the axis is seen [pixels]
  double near = 0.0;  // [m]; of a pinhole > 0, of an orthographic camera -infinity to see all
};

/// throws   InputError naming the member that is out of its range
void require_camera(const Camera& camera);

/// A point as a camera sees it: (U, V, W, Z) with u = U / W, v = V / W and the depth Z. Linear in the point: W is Z of
/// a pinhole and 1 of an orthographic camera.
using SeenPoint = Eigen::Vector4d;
using SeenPoints = Eigen::Matrix4Xd;

SeenPoints seen_points(const Camera& camera, const Points& points);

}  // namespace touchfield
