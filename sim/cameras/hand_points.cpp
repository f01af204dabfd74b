#include "sim/cameras/hand_points.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/core/require.h"

namespace touchfield {

namespace {

constexpr int kCoarse = 4;     // spacing of the pixels that are looked at first [pixels]
constexpr int kRing = 2;       // rows round a pixel that its depth is taken from
constexpr int kNarrowest = 2;  // half a window [pixels]
constexpr int kWidest = 6;
constexpr double kNoiseStep = 4.0;    // deviations by which neighbours of one surface may differ
constexpr double kLeastShare = 0.55;  // of a window's pixels that a normal needs

void require_options(const PointOptions& options) {
  if (!(options.most >= 1 && options.window > 0 && options.baseline > 0 && options.disparity_noise >= 0 &&
        options.steepest > 0 && options.steepest < 0.5 * std::numbers::pi)) {
    throw InputError(
        fmt::format("points of depth images: most {} (>= 1), window {} m (> 0), baseline {} m (> 0), "
                    "disparity noise {} pixels (>= 0) or steepest {} rad (0 to pi / 2) is out of its range",
                    options.most, options.window, options.baseline, options.disparity_noise, options.steepest));
  }
}

/// Sums over a window, of pixels' rays (u, v) and inverse depths w relative to the middle's.
struct WindowSums {
  double count = 0;
  double u = 0, v = 0, w = 0;
  double uu = 0, uv = 0, vv = 0, uw = 0, vw = 0;

  void add(double du, double dv, double dw) {
    count += 1;
    u += du;
    v += dv;
    w += dw;
    uu += du * du;
    uv += du * dv;
    vv += dv * dv;
    uw += du * dw;
    vw += dv * dw;
  }

  /// Slopes of w along u and v; false if the pixels lie on a line.
  bool slopes(double& along_u, double& along_v) const {
    const double cuu = uu - u * u / count;
    const double cuv = uv - u * v / count;
    const double cvv = vv - v * v / count;
    const double cuw = uw - u * w / count;
    const double cvw = vw - v * w / count;
    const double determinant = cuu * cvv - cuv * cuv;
    along_u = (cvv * cuw - cuv * cvw) / determinant;
    along_v = (cuu * cvw - cuv * cuw) / determinant;
    return determinant > 1e-6 * cuu * cvv;
  }
};

}  // namespace

void require_frame(const std::vector<DepthCamera>& cameras, const DepthFrame& frame) {
  require(frame.images.size() == cameras.size(), "{} depth images of {} cameras", frame.images.size(), cameras.size());
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    const Camera& view = cameras[c].view;
    const DepthImage& image = frame.images[c];
    if (image.width != view.width || image.height != view.height ||
        image.depth.size() != static_cast<std::size_t>(view.width) * static_cast<std::size_t>(view.height)) {
      throw InputError(fmt::format("camera {}: its depth image is {} x {} ({} numbers) and must be {} x {}",
                                   cameras[c].name, image.width, image.height, image.depth.size(), view.width,
                                   view.height));
    }
  }
}

PointReader::PointReader(std::vector<DepthCamera> cameras, const PointOptions& options)
    : cameras_(std::move(cameras)), options_(options) {
  require_options(options);
  steepest_slope_ = std::tan(options.steepest);
  for (const DepthCamera& camera : cameras_) {
    require_camera(camera.view);
    require(camera.view.projection == Camera::Projection::kPinhole, "camera {}: a depth camera must be a pinhole",
            camera.name);
    rays_.push_back(pixel_rays(camera));
  }
}

Vector3 PointReader::seen_at(std::size_t camera, Eigen::Index pixel, double depth) const {
  const Camera& view = cameras_[camera].view;
  return view.eye + depth * (view.axes * rays_[camera].col(pixel).homogeneous());
}

double PointReader::noise(const DepthCamera& camera, double depth) const {
  const double stereo = depth * depth * options_.disparity_noise / (camera.view.focal.x() * options_.baseline);
  return std::sqrt(stereo * stereo + camera.depth_unit * camera.depth_unit / 12);
}

/// The grid of pixels whose points lie in the box.
std::vector<PointReader::Pixel> PointReader::chosen(std::size_t camera, const DepthImage& image,
                                                    const Box& within) const {
  std::vector<Pixel> found;
  const auto scan = [&](Pixel first, Pixel last, int spacing) {
    found.clear();
    int shift = 0;
    for (int row = first.row; row <= last.row; row += spacing) {
      for (int column = first.column + shift; column <= last.column; column += spacing) {
        const int pixel = row * image.width + column;
        const float depth = image.depth[static_cast<std::size_t>(pixel)];
        if (depth > 0 && within.contains(seen_at(camera, pixel, static_cast<double>(depth)))) {
          found.push_back({column, row});
        }
      }
      shift = shift == 0 ? spacing / 2 : 0;
    }
  };
  scan({0, 0}, {image.width - 1, image.height - 1}, kCoarse);
  if (found.empty()) {
    return found;
  }
  Pixel first = found.front();
  Pixel last = found.back();
  for (const Pixel& pixel : found) {
    first.column = std::min(first.column, pixel.column);
    last.column = std::max(last.column, pixel.column);
  }
  first = {std::max(first.column - kCoarse, 0), std::max(first.row - kCoarse, 0)};
  last = {std::min(last.column + kCoarse, image.width - 1), std::min(last.row + kCoarse, image.height - 1)};
  const double expected = static_cast<double>(found.size()) * kCoarse * kCoarse;
  int spacing = std::max(1, static_cast<int>(std::ceil(std::sqrt(expected / options_.most))));
  do {
    scan(first, last, spacing++);
  } while (found.size() > static_cast<std::size_t>(options_.most));
  return found;
}

/// The surface that a pixel and those round it saw; false if they saw more than one, or one too steep.
bool PointReader::surface_at(std::size_t camera, const DepthImage& image, Pixel pixel, Surface& surface) const {
  const DepthCamera& seen_by = cameras_[camera];
  const Eigen::Matrix2Xd& rays = rays_[camera];
  const int middle = pixel.row * image.width + pixel.column;
  const auto depth = static_cast<double>(image.depth[static_cast<std::size_t>(middle)]);
  const double spacing = depth / seen_by.view.focal.x();
  const double noise_step = kNoiseStep * noise(seen_by, depth);
  const double step = spacing * steepest_slope_;
  if (pixel.column < kRing || pixel.row < kRing || pixel.column >= image.width - kRing ||
      pixel.row >= image.height - kRing) {
    return false;
  }
  double inner = 0;
  double outer = 0;
  bool whole = true;
  for (int row = -kRing; row <= kRing; ++row) {
    for (int column = -kRing; column <= kRing; ++column) {
      const int pixel = middle + row * image.width + column;
      const auto z = static_cast<double>(image.depth[static_cast<std::size_t>(pixel)]);
      const bool same = z > 0 && std::abs(z - depth) <= noise_step + (std::abs(row) + std::abs(column)) * step;
      if (std::max(std::abs(row), std::abs(column)) > 1) {
        whole = whole && same;
        outer += 1.0 / z;
      } else if (same) {
        inner += 1.0 / z;
      } else {
        return false;
      }
    }
  }
  // What is quadratic in the pixels adds 4/3 of its second differences to the mean of 3 x 3, 4 to that of 5 x 5.
  const double inverse = whole ? 1.5 * inner / 9 - 0.5 * (inner + outer) / 25 : 1.0 / depth;

  const int half = std::clamp(static_cast<int>(std::lround(options_.window / spacing)), kNarrowest, kWidest);
  const Eigen::Vector2d ray = rays.col(middle);
  WindowSums sums;
  for (int row = std::max(pixel.row - half, 0); row <= std::min(pixel.row + half, image.height - 1); ++row) {
    for (int column = std::max(pixel.column - half, 0); column <= std::min(pixel.column + half, image.width - 1);
         ++column) {
      const int at = row * image.width + column;
      const auto z = static_cast<double>(image.depth[static_cast<std::size_t>(at)]);
      const int away = std::max(std::abs(row - pixel.row), std::abs(column - pixel.column));
      if (z > 0 && std::abs(z - depth) <= noise_step + away * step) {
        sums.add(rays(0, at) - ray.x(), rays(1, at) - ray.y(), 1.0 / z - inverse);
      }
    }
  }
  double a = 0;
  double b = 0;
  if (sums.count < kLeastShare * (2 * half + 1) * (2 * half + 1) || !sums.slopes(a, b)) {
    return false;
  }
  const Vector3 normal = -Vector3(a, b, inverse - a * ray.x() - b * ray.y()).normalized();
  const Vector3 towards = -ray.homogeneous().normalized();
  if (!(normal.dot(towards) >= 1.0 / std::hypot(1.0, steepest_slope_))) {
    return false;
  }
  surface = {1.0 / inverse, normal};
  return true;
}

HandPoints PointReader::read(const DepthFrame& frame, const Box& within) const {
  require_frame(cameras_, frame);
  std::vector<std::vector<Pixel>> pixels;
  std::size_t most = 0;
  for (std::size_t c = 0; c < cameras_.size(); ++c) {
    pixels.push_back(chosen(c, frame.images[c], within));
    most += pixels.back().size();
  }
  HandPoints points;
  points.at.resize(3, static_cast<Eigen::Index>(most));
  points.normal.resize(3, points.at.cols());
  points.sigma.resize(points.at.cols());
  points.camera.reserve(most);
  Eigen::Index count = 0;
  for (std::size_t c = 0; c < cameras_.size(); ++c) {
    for (const Pixel& pixel : pixels[c]) {
      Surface surface;
      if (surface_at(c, frame.images[c], pixel, surface)) {
        points.at.col(count) = seen_at(c, pixel.row * frame.images[c].width + pixel.column, surface.depth);
        points.normal.col(count) = cameras_[c].view.axes * surface.normal;
        points.sigma(count++) = noise(cameras_[c], surface.depth);
        points.camera.push_back(static_cast<int>(c));
      }
    }
  }
  points.at.conservativeResize(3, count);
  points.normal.conservativeResize(3, count);
  points.sigma.conservativeResize(count);
  return points;
}

}  // namespace touchfield
