#include "sim/cameras/simulated_camera.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include "sim/core/random.h"
#include "sim/scene/camera_models.h"

namespace touchfield {

namespace {

constexpr double kNearPlane = 1e-3;  // of what hides something [m]: in front of a camera's nearest depth too

/// Right, down, forward.
Eigen::Matrix3d looking_axes(const CameraSpec& spec) {
  constexpr double kUpright = 1e-6;  // sine of the angle from the vertical below which nothing is level across it
  const Vector3 forward = (spec.look_at - spec.at).normalized();
  const Vector3 level = forward.cross(Vector3::UnitZ());
  Eigen::Matrix3d axes;
  axes.col(2) = forward;
  axes.col(1) = forward.cross(level.norm() > kUpright ? level : Vector3::UnitX()).normalized();
  axes.col(0) = axes.col(1).cross(forward);
  return Eigen::AngleAxisd(spec.roll, forward) * axes;
}

/// Uniform on the unit sphere.
Vector3 drawn_direction(NormalPairs& normals) {
  const NormalPairs::Polar first = normals.next();
  return Vector3(first.first(), first.second(), normals.next().first()).normalized();
}

}  // namespace

StereoCamera stereo_camera(const CameraSpec& spec) {
  const CameraModel& model = camera_model(spec.model);
  const auto [width, height] = spec.resolution;
  StereoCamera camera;
  Camera& view = camera.view;
  view.width = width;
  view.height = height;
  view.eye = spec.at;
  view.axes = looking_axes(spec);
  view.focal.setConstant(std::max(static_cast<double>(width), height * 16.0 / 9.0) / (2 * std::tan(model.across / 2)));
  view.centre << 0.5 * width, 0.5 * height;
  view.near = kNearPlane;
  camera.baseline = model.baseline;
  camera.widest_disparity = model.widest_disparity;
  camera.disparity_noise = spec.disparity_noise;
  camera.depth_unit = spec.depth_unit;
  return camera;
}

DepthImage exact_image(const Camera& camera, const TriangleMesh& mesh) {
  const Raster raster = rasterise(camera, mesh.vertices(), mesh.triangles());
  DepthImage image{raster.width, raster.height, std::vector<float>(raster.depth.size())};
  std::ranges::transform(raster.depth, image.depth.begin(),
                         [](double depth) { return std::isfinite(depth) ? static_cast<float>(depth) : 0.0F; });
  return image;
}

SimulatedCameras::SimulatedCameras(const std::vector<CameraSpec>& specs, std::uint64_t seed) : seed_(seed) {
  // Apart from the keys of all frames: a frame's number is no more than 2^63.
  constexpr std::uint64_t kOfPlaces = ~std::uint64_t{0};
  for (const CameraSpec& spec : specs) {
    real_.push_back(stereo_camera(spec));
    NormalPairs normals(noise_key(seed, told_.size(), kOfPlaces));
    const Vector3 shift = spec.shift_error * drawn_direction(normals);
    const Eigen::AngleAxisd turn(spec.turn_error, drawn_direction(normals));
    DepthCamera told{
        .name = fmt::format("camera_{}", told_.size() + 1), .view = real_.back().view, .depth_unit = spec.depth_unit};
    told.view.eye += told.view.axes * shift;
    told.view.axes = told.view.axes * turn.toRotationMatrix();
    told_.push_back(std::move(told));
  }
}

DepthFrame SimulatedCameras::sees(const TriangleMesh& mesh, double seconds, std::uint64_t frame,
                                  const StereoEffects& effects) const {
  DepthFrame seen{seconds, {}};
  for (std::size_t c = 0; c < real_.size(); ++c) {
    const Raster raster = rasterise(real_[c].view, mesh.vertices(), mesh.triangles());
    seen.images.push_back(stereo_image(real_[c], raster, mesh.normals(), effects, noise_key(seed_, c, frame)));
  }
  return seen;
}

}  // namespace touchfield
