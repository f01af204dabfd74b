#include "sim/cameras/depth_camera.h"

#include <fmt/format.h>

#include "sim/core/require.h"

namespace touchfield {

namespace {

constexpr int kRounds = 50;
constexpr double kUndone = 1e-9;
constexpr double kSameRay = 1e-6;

bool is_straight(const DepthCamera& camera) { return camera.distortion == std::array<double, 5>{}; }

/// The ray that the lens puts at `seen`, by fixed-point steps from there; nothing if they do not end.
std::optional<Eigen::Vector2d> undistorted(const DepthCamera& camera, const Eigen::Vector2d& seen) {
  Eigen::Vector2d ray = seen;
  for (int round = 0; round < kRounds; ++round) {
    const Eigen::Vector2d off = distorted(camera, ray) - seen;
    ray -= off;
    if (off.norm() <= kUndone) {
      return ray;
    }
  }
  return {};
}

}  // namespace

Eigen::Vector2d distorted(const DepthCamera& camera, const Eigen::Vector2d& x) {
  const std::array<double, 5>& d = camera.distortion;
  const double r2 = x.squaredNorm();
  const double radial = 1 + r2 * (d[0] + r2 * (d[1] + r2 * d[4]));
  const double xy = 2 * x.x() * x.y();
  return radial * x +
         Eigen::Vector2d(d[2] * xy + d[3] * (r2 + 2 * x.x() * x.x()), d[2] * (r2 + 2 * x.y() * x.y()) + d[3] * xy);
}

std::optional<ImagePoint> image_point(const DepthCamera& camera, const Vector3& x) {
  const Camera& view = camera.view;
  const Vector3 local = view.axes.transpose() * (x - view.eye);
  if (!(local.z() > view.near)) {
    return {};
  }
  ImagePoint point{{}, local.head<2>() / local.z(), local.z()};
  const bool straight = is_straight(camera);
  const Eigen::Vector2d seen = straight ? point.ray : distorted(camera, point.ray);
  point.at = seen.cwiseProduct(view.focal) + view.centre;
  if (!(point.at.x() >= 0 && point.at.y() >= 0 && point.at.x() < view.width && point.at.y() < view.height)) {
    return {};
  }
  if (!straight) {
    const auto ray = undistorted(camera, seen);
    if (!ray || (*ray - point.ray).norm() > kSameRay) {
      return {};
    }
  }
  return point;
}

Eigen::Matrix2Xd pixel_rays(const DepthCamera& camera) {
  const Camera& view = camera.view;
  const bool straight = is_straight(camera);
  Eigen::Matrix2Xd rays(2, static_cast<Eigen::Index>(view.width) * view.height);
  Eigen::Index pixel = 0;
  for (int j = 0; j < view.height; ++j) {
    for (int i = 0; i < view.width; ++i) {
      const Eigen::Vector2d seen = (Eigen::Vector2d(i + 0.5, j + 0.5) - view.centre).cwiseQuotient(view.focal);
      const auto ray = straight ? std::optional(seen) : undistorted(camera, seen);
      require(ray, "camera {}: distortion cannot be undone at pixel ({}, {})", camera.name, i, j);
      rays.col(pixel++) = *ray;
    }
  }
  return rays;
}

}  // namespace touchfield
