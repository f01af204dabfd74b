#pragma once

#include <cmath>
#include <random>
#include <vector>

#include "sim/cameras/depth_camera.h"
#include "sim/core/units.h"
#include "sim/mesh/triangle_mesh.h"
#include "tests/support/random_support.h"

namespace touchfield {

/// 640 x 360 pixels over 65 degrees, as a D415 has them.
inline DepthCamera depth_camera(const Vector3& at, const Vector3& look_at, const Vector3& up = Vector3::UnitZ()) {
  DepthCamera camera;
  camera.name = "test";
  camera.view.width = 640;
  camera.view.height = 360;
  camera.view.eye = at;
  const Vector3 forward = (look_at - at).normalized();
  const Vector3 right = forward.cross(up).normalized();
  camera.view.axes << right, forward.cross(right), forward;
  camera.view.focal.setConstant(320 / std::tan(32.5 * kDegree));
  camera.view.centre << 320, 180;
  camera.view.near = 0.05;
  return camera;
}

/// Cameras beside a point below a hand, looking up at it.
inline std::vector<DepthCamera> cameras_round(const Vector3& look_at, double away, double below, int count) {
  std::vector<DepthCamera> cameras;
  for (int i = 0; i < count; ++i) {
    const double turn = 2 * std::numbers::pi * i / count;
    cameras.push_back(depth_camera(look_at + Vector3(away * std::cos(turn), away * std::sin(turn), -below), look_at));
  }
  return cameras;
}

inline DepthImage exact_image(const DepthCamera& camera, const TriangleMesh& mesh) {
  const Raster raster = rasterise(camera.view, mesh.vertices(), mesh.triangles());
  DepthImage image{raster.width, raster.height, {}};
  for (const double depth : raster.depth) {
    image.depth.push_back(std::isfinite(depth) ? static_cast<float>(depth) : 0.0F);
  }
  return image;
}

inline DepthFrame exact_frame(const std::vector<DepthCamera>& cameras, const TriangleMesh& mesh) {
  DepthFrame frame;
  for (const DepthCamera& camera : cameras) {
    frame.images.push_back(exact_image(camera, mesh));
  }
  return frame;
}

/// Adds Z^2 s / (f B) of noise, s = `pixels` rms and B = 55 mm, correlated by exp(-r^2 / (4 2.5^2)) over r pixels, and
/// rounds to `unit` [m].
inline void add_stereo_noise(DepthFrame& frame, const std::vector<DepthCamera>& cameras, unsigned seed,
                             double pixels = 0.08, double unit = 1e-3) {
  constexpr int kHalf = 7;
  const Eigen::VectorXd weights =
      (-0.5 * (Eigen::ArrayXd::LinSpaced(2 * kHalf + 1, -kHalf, kHalf) / 2.5).square()).exp();
  std::mt19937 random(seed);
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    DepthImage& image = frame.images[c];
    Eigen::MatrixXd white(image.width + 2 * kHalf, image.height + 2 * kHalf);
    for (double& value : white.reshaped()) {
      value = std::sqrt(3.0) * uniform(random, -1, 1);
    }
    Eigen::MatrixXd across = Eigen::MatrixXd::Zero(image.width, white.cols());
    Eigen::MatrixXd noise = Eigen::MatrixXd::Zero(image.width, image.height);
    for (Eigen::Index k = 0; k < weights.size(); ++k) {
      across += weights(k) * white.middleRows(k, image.width);
    }
    for (Eigen::Index k = 0; k < weights.size(); ++k) {
      noise += weights(k) / weights.squaredNorm() * across.middleCols(k, image.height);
    }
    const double slope = pixels / (cameras[c].view.focal.x() * 55e-3);
    for (std::size_t i = 0; i < image.depth.size(); ++i) {
      if (image.depth[i] > 0) {
        const auto z = static_cast<double>(image.depth[i]);
        image.depth[i] = static_cast<float>(unit * std::round((z + slope * z * z * noise.data()[i]) / unit));
      }
    }
  }
}

}  // namespace touchfield
