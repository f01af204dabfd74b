#pragma once

#include <cmath>
#include <random>
#include <vector>

#include "sim/core/units.h"
#include "sim/mesh/triangle_mesh.h"
#include "sim/sensing/depth_camera.h"
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

/// Adds Z^2 s / (f B) of noise, s = `pixels` rms, white noise averaged over 5 x 5 pixels, and rounds to `unit` [m].
inline void add_stereo_noise(DepthFrame& frame, const std::vector<DepthCamera>& cameras, unsigned seed,
                             double pixels = 0.08, double unit = 1e-3) {
  std::mt19937 random(seed);
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    DepthImage& image = frame.images[c];
    Eigen::ArrayXXd white(image.width + 4, image.height + 4);
    for (double& value : white.reshaped()) {
      value = std::sqrt(3.0) * uniform(random, -1, 1);
    }
    const double slope = pixels / (cameras[c].view.focal.x() * 55e-3);
    for (int row = 0; row < image.height; ++row) {
      for (int column = 0; column < image.width; ++column) {
        float& depth = image.depth[static_cast<std::size_t>(row * image.width + column)];
        if (depth > 0) {
          const auto z = static_cast<double>(depth);
          const double noise = 5 * white.block<5, 5>(column, row).mean();
          depth = static_cast<float>(unit * std::round((z + slope * z * z * noise) / unit));
        }
      }
    }
  }
}

}  // namespace touchfield
