#include "sim/sensing/depth_camera.h"

#include <fmt/format.h>

#include "sim/core/errors.h"

namespace touchfield {

namespace {

constexpr int kRounds = 50;
constexpr double kUndone = 1e-9;

}  // namespace

Eigen::Vector2d distorted(const DepthCamera& camera, const Eigen::Vector2d& x) {
  const std::array<double, 5>& d = camera.distortion;
  const double r2 = x.squaredNorm();
  const double radial = 1 + r2 * (d[0] + r2 * (d[1] + r2 * d[4]));
  const double xy = 2 * x.x() * x.y();
  return radial * x +
         Eigen::Vector2d(d[2] * xy + d[3] * (r2 + 2 * x.x() * x.x()), d[2] * (r2 + 2 * x.y() * x.y()) + d[3] * xy);
}

Eigen::Matrix2Xd pixel_rays(const DepthCamera& camera) {
  const Camera& view = camera.view;
  const bool straight = camera.distortion == std::array<double, 5>{};
  Eigen::Matrix2Xd rays(2, static_cast<Eigen::Index>(view.width) * view.height);
  Eigen::Index pixel = 0;
  for (int j = 0; j < view.height; ++j) {
    for (int i = 0; i < view.width; ++i) {
      const Eigen::Vector2d seen = (Eigen::Vector2d(i + 0.5, j + 0.5) - view.centre).cwiseQuotient(view.focal);
      Eigen::Vector2d ray = seen;
      double error = straight ? 0.0 : 1.0;
      for (int round = 0; round < kRounds && error > kUndone; ++round) {
        const Eigen::Vector2d off = distorted(camera, ray) - seen;
        ray -= off;
        error = off.norm();
      }
      if (!(error <= kUndone)) {
        throw InputError(fmt::format("camera {}: distortion cannot be undone at pixel ({}, {})", camera.name, i, j));
      }
      rays.col(pixel++) = ray;
    }
  }
  return rays;
}

}  // namespace touchfield
