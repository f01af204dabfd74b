#include "sim/cameras/simulated_camera.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include "sim/core/random.h"
#include "sim/scene/sensor_table.h"

namespace touchfield {

namespace {

constexpr int kReach = 10;  // of the noise's weights [pixels]: four deviations

/// The number that a pixel counts as, also those around the image that its noise needs.
std::uint64_t pixel_number(int width, int column, int row) {
  return static_cast<std::uint64_t>(row + kReach) * static_cast<std::uint64_t>(width + 2 * kReach) +
         static_cast<std::uint64_t>(column + kReach);
}

/// Weights whose squares sum to one.
std::vector<float> noise_weights() {
  std::vector<float> weights;
  double squares = 0;
  for (int k = -kReach; k <= kReach; ++k) {
    weights.push_back(static_cast<float>(std::exp(-0.5 * k * k / (kNoiseBlur * kNoiseBlur))));
    squares += static_cast<double>(weights.back()) * static_cast<double>(weights.back());
  }
  for (float& weight : weights) {
    weight /= static_cast<float>(std::sqrt(squares));
  }
  return weights;
}

/// Gaussian noise of unit variance over a part of an image, row by row.
std::vector<float> correlated_noise(int image_width, const SeenPart& part, std::uint64_t key) {
  static const std::vector<float> weights = noise_weights();
  const float spread = std::sqrt(12.0F);  // uniform numbers of unit variance
  const int width = part.width();
  const int rows = part.height() + 2 * kReach;
  std::vector<float> white(static_cast<std::size_t>(width + 2 * kReach));
  std::vector<float> across(static_cast<std::size_t>(width) * static_cast<std::size_t>(rows));
  for (int j = 0; j < rows; ++j) {
    const std::uint64_t first = key + pixel_number(image_width, part.left - kReach, part.top + j - kReach);
    for (std::size_t i = 0; i < white.size(); ++i) {
      white[i] =
          spread * (static_cast<float>(static_cast<std::int64_t>(mixed_bits(first + i) >> 40U)) * 0x1p-24F - 0.5F);
    }
    float* to = across.data() + static_cast<std::ptrdiff_t>(j) * width;
    for (std::size_t k = 0; k < weights.size(); ++k) {
      for (int i = 0; i < width; ++i) {
        to[i] += weights[k] * white[static_cast<std::size_t>(i) + k];
      }
    }
  }
  std::vector<float> noise(static_cast<std::size_t>(width) * static_cast<std::size_t>(part.height()));
  for (int j = 0; j < part.height(); ++j) {
    float* to = noise.data() + static_cast<std::ptrdiff_t>(j) * width;
    for (std::size_t k = 0; k < weights.size(); ++k) {
      const float* from = across.data() + (j + static_cast<std::ptrdiff_t>(k)) * width;
      for (int i = 0; i < width; ++i) {
        to[i] += weights[k] * from[i];
      }
    }
  }
  return noise;
}

/// Sets the depth that flies to and holes of a row of the exact image to 0, before noise.
class RowMaker {
 public:
  RowMaker(const StereoCamera& camera, const Raster& raster, const Points& normals, const StereoEffects& effects,
           std::uint64_t key)
      : camera_(camera), raster_(raster), normals_(normals), effects_(effects), key_(mixed_bits(key)) {}

  /// disparity   of the part's columns; 0 where the camera has none
  void row(const SeenPart& part, int j, std::vector<double>& disparity) const {
    double nearest_column =
        std::numeric_limits<double>::infinity();  // in the second eye's image, of what lies to the right
    for (int i = part.right - 1; i >= part.left; --i) {
      double& d = disparity[static_cast<std::size_t>(i - part.left)];
      d = disparity_at(i, j);
      if (d == 0) {
        continue;
      }
      const double second = i + 0.5 - d;
      const bool unseen = second >= nearest_column || second < 0;
      nearest_column = std::min(nearest_column, second);
      if ((effects_.second_eye && unseen) || (effects_.range && d > camera_.widest_disparity) ||
          (effects_.grazing && grazing(i, j))) {
        d = 0;
      } else if (effects_.flying) {
        d = flown(i, j, d);
      }
    }
  }

 private:
  /// 0 where nothing is seen.
  double disparity_at(int column, int row) const {
    const double depth = raster_.depth[raster_.index(column, row)];
    return std::isfinite(depth) ? camera_.disparity_metres() / depth : 0.0;
  }

  /// The depth behind a pixel that lies at an edge, of its farthest neighbour across it; else the pixel's own.
  double behind(int column, int row) const {
    double least = disparity_at(column, row) - kEdgeJump;
    bool edge = false;
    const auto look = [&](int i, int j) {
      if (i >= 0 && i < raster_.width && j >= 0 && j < raster_.height && disparity_at(i, j) < least) {
        least = disparity_at(i, j);
        edge = true;
      }
    };
    look(column - 1, row);
    look(column + 1, row);
    look(column, row - 1);
    look(column, row + 1);
    return edge ? camera_.disparity_metres() / least : raster_.depth[raster_.index(column, row)];
  }

  bool grazing(int i, int j) const {
    static const double least_cosine = std::cos(kGrazing);
    const Camera& view = camera_.view;
    const Vector3 ray = view.axes.col(2) + (i + 0.5 - view.centre.x()) / view.focal.x() * view.axes.col(0) +
                        (j + 0.5 - view.centre.y()) / view.focal.y() * view.axes.col(1);
    const double cosine = ray.dot(normals_.col(raster_.face[raster_.index(i, j)]));
    return cosine * cosine < least_cosine * least_cosine * ray.squaredNorm();
  }

  double flown(int i, int j, double d) const {
    const double drawn = unit_number(mixed_bits(key_ + pixel_number(raster_.width, i, j)));
    if (drawn >= kFlyingShare) {
      return d;
    }
    const double front = raster_.depth[raster_.index(i, j)];
    const double back = std::min(behind(i, j), front + kLongestFlight);
    return camera_.disparity_metres() / (front + drawn / kFlyingShare * (back - front));
  }

  const StereoCamera& camera_;
  const Raster& raster_;
  const Points& normals_;
  const StereoEffects& effects_;
  std::uint64_t key_;
};

}  // namespace

SeenPart seen_part(const Raster& raster) {
  SeenPart part{raster.width, raster.height, 0, 0};
  for (int j = 0; j < raster.height; ++j) {
    const auto row = raster.face.begin() + static_cast<std::ptrdiff_t>(raster.index(0, j));
    const auto sees = [](int face) { return face != Raster::kNothing; };
    const auto first = std::find_if(row, row + raster.width, sees);
    if (first == row + raster.width) {
      continue;
    }
    int last = raster.width - 1;
    while (!sees(row[last])) {
      --last;
    }
    part.left = std::min(part.left, static_cast<int>(first - row));
    part.right = std::max(part.right, last + 1);
    part.top = std::min(part.top, j);
    part.bottom = j + 1;
  }
  return part;
}

std::uint64_t noise_key(std::uint64_t seed, std::uint64_t camera, std::uint64_t frame) {
  return mixed_bits(mixed_bits(mixed_bits(seed) + camera) + frame);
}

DepthImage stereo_image(const StereoCamera& camera, const Raster& raster, const Points& normals,
                        const StereoEffects& effects, std::uint64_t key) {
  DepthImage image{raster.width, raster.height, std::vector<float>(raster.depth.size(), 0.0F)};
  const SeenPart part = seen_part(raster);
  if (part.right <= part.left) {
    return image;
  }
  const RowMaker maker(camera, raster, normals, effects, key);
  const bool noisy = effects.noise && camera.disparity_noise > 0;
  const std::vector<float> noise = noisy ? correlated_noise(raster.width, part, key) : std::vector<float>();
  std::vector<double> disparity(static_cast<std::size_t>(part.width()));
  std::size_t place = 0;
  for (int j = part.top; j < part.bottom; ++j) {
    maker.row(part, j, disparity);
    float* to = image.depth.data() + raster.index(part.left, j);
    for (double d : disparity) {
      const std::size_t at = place++;
      float& depth = *to++;
      if (d == 0) {
        continue;
      }
      d += noisy ? camera.disparity_noise * static_cast<double>(noise[at]) : 0.0;
      d = effects.disparity_steps ? std::round(d / kDisparityStep) * kDisparityStep : d;
      if (!(d > 0)) {
        continue;
      }
      double z = camera.disparity_metres() / d;
      if (effects.depth_steps) {
        const double units = std::round(z / camera.depth_unit);
        z = units > kMostUnits ? 0.0 : units * camera.depth_unit;
      }
      depth = static_cast<float>(z);
    }
  }
  return image;
}

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
