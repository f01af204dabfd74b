#include "sim/cameras/seen_skin.h"

#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "sim/cameras/vertex_grid.h"
#include "sim/core/require.h"

namespace touchfield {

namespace {

constexpr int kCoarse = 4;     // spacing of the pixels that are looked at first [pixels]
constexpr int kRing = 2;       // rows round a pixel that its depth is taken from
constexpr int kNarrowest = 2;  // half a window [pixels]
constexpr int kWidest = 6;
constexpr double kNoiseStep = 4.0;    // deviations by which neighbours of one surface may differ
constexpr double kLeastShare = 0.55;  // of a window's pixels that a normal needs

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
    require(image.width == view.width && image.height == view.height &&
                image.depth.size() == static_cast<std::size_t>(view.width) * static_cast<std::size_t>(view.height),
            "camera {}: its depth image is {} x {} ({} numbers) and must be {} x {}", cameras[c].name, image.width,
            image.height, image.depth.size(), view.width, view.height);
  }
}

PointReader::PointReader(std::vector<DepthCamera> cameras, const PointOptions& options)
    : cameras_(std::move(cameras)), options_(options) {
  require(options.most >= 1 && options.window > 0 && options.baseline > 0 && options.disparity_noise >= 0 &&
              options.steepest > 0 && options.steepest < 0.5 * std::numbers::pi,
          "points of depth images: most {} (>= 1), window {} m (> 0), baseline {} m (> 0), disparity noise {} pixels "
          "(>= 0) or steepest {} rad (0 to pi / 2) is out of its range",
          options.most, options.window, options.baseline, options.disparity_noise, options.steepest);
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

namespace {

constexpr double kTowards = 0.34;    // cosine between normal and ray
constexpr double kEdge = 3;          // that an edge is off [pixels]
constexpr int kOutline = 4;          // that is missing along outlines [pixels]
constexpr int kHole = 40;            // half of the widest hole in a hand [pixels]
constexpr double kSameBody = 40e-3;  // in depth [m]
constexpr double kAgreeing = 0.1;    // of what the camera that confirms most does
constexpr double kOwn = 10e-3;       // from a vertex, still the skin's [m]

double depth_at(const DepthImage& image, int column, int row) {
  return static_cast<double>(image.depth[static_cast<std::size_t>(row) * static_cast<std::size_t>(image.width) +
                                         static_cast<std::size_t>(column)]);
}

/// The depth of a pixel or, if it saw nothing, of one of the eight round it; 0 if none saw anything.
double depth_round(const DepthImage& image, int column, int row) {
  const auto at = [&](int i, int j) { return depth_at(image, i, j); };
  if (at(column, row) > 0) {
    return at(column, row);
  }
  for (int j = std::max(row - 1, 0); j <= std::min(row + 1, image.height - 1); ++j) {
    for (int i = std::max(column - 1, 0); i <= std::min(column + 1, image.width - 1); ++i) {
      if (at(i, j) > 0) {
        return at(i, j);
      }
    }
  }
  return 0;
}

/// Whether what is nearer, further to the right in the row, hides a point at that depth from the second eye.
bool hidden_from_second_eye(const DepthImage& image, int column, int row, double depth, double tolerance,
                            double disparity_metres) {
  for (int i = column + 1; i < image.width; ++i) {
    const double seen = depth_at(image, i, row);
    if (seen > 0) {
      return seen < depth - tolerance && i - column <= disparity_metres * (1 / seen - 1 / depth) + kEdge;
    }
  }
  return false;
}

/// Whether a pixel that saw nothing lacks skin of that depth all the same: at an outline, or in a hole.
bool beside_or_within(const DepthImage& image, int column, int row, double depth) {
  constexpr std::array<std::array<int, 2>, 4> kWays{{{1, 0}, {-1, 0}, {0, 1}, {0, -1}}};
  int round = 0;
  for (const auto& [right, down] : kWays) {
    for (int step = 1; step <= kHole; ++step) {
      const int i = column + step * right;
      const int j = row + step * down;
      if (i < 0 || j < 0 || i >= image.width || j >= image.height) {
        break;
      }
      if (const double seen = depth_at(image, i, j); seen > 0) {
        if (std::abs(seen - depth) < kSameBody) {
          if (step <= kOutline) {
            return true;
          }
          ++round;
        }
        break;
      }
    }
  }
  return round >= 3;
}

}  // namespace

void check_sight(const std::vector<DepthCamera>& cameras, const DepthFrame& frame, const Points& vertices,
                 const Points& normals, double tolerance, double baseline, SightCheck& check) {
  const Eigen::Index count = vertices.cols();
  const auto number = static_cast<Eigen::Index>(cameras.size());
  check.confirmed.setZero(count);
  check.refuted.setZero(count);
  check.blank.setZero(count);
  check.covered.setZero(count);
  check.confirmed_by.assign(cameras.size(), 0);
  // Of each camera: vertices that face it, that are in its image, blank and covered.
  Eigen::ArrayXXd faces = Eigen::ArrayXXd::Zero(count, number);
  Eigen::ArrayXXd looked = faces;
  Eigen::ArrayXXd blank = faces;
  Eigen::ArrayXXd covered = faces;
  VertexGrid grid;
  grid.build(vertices, normals, kOwn);
  for (Eigen::Index c = 0; c < number; ++c) {
    const DepthCamera& camera = cameras[static_cast<std::size_t>(c)];
    const DepthImage& image = frame.images[static_cast<std::size_t>(c)];
    for (Eigen::Index v = 0; v < count; ++v) {
      const Vector3 from_eye = vertices.col(v) - camera.view.eye;
      if (-normals.col(v).dot(from_eye) < kTowards * from_eye.norm()) {
        continue;
      }
      faces(v, c) = 1;
      const std::optional<ImagePoint> point = image_point(camera, vertices.col(v));
      if (!point) {
        continue;
      }
      looked(v, c) = 1;
      const auto column = static_cast<int>(point->at.x());
      const auto row = static_cast<int>(point->at.y());
      const double depth = depth_round(image, column, row);
      if (depth > 0 && std::abs(depth - point->depth) <= tolerance) {
        check.confirmed(v) += 1;
        ++check.confirmed_by[static_cast<std::size_t>(c)];
      } else if (depth > point->depth) {
        check.refuted(v) += 1;
      } else if (depth == 0 && !beside_or_within(image, column, row, point->depth) &&
                 !hidden_from_second_eye(image, column, row, point->depth, tolerance,
                                         camera.view.focal.x() * baseline)) {
        blank(v, c) = 1;
      } else if (depth > 0) {
        const Vector3 hiding = camera.view.eye + from_eye * (depth / point->depth);
        covered(v, c) = grid.squared_distance(hiding) > kOwn * kOwn ? 1 : 0;
      }
    }
  }
  // A camera that confirms next to nothing of what another one does looks elsewhere, or stands where it is not told to
  // be.
  const int most = *std::ranges::max_element(check.confirmed_by);
  Eigen::ArrayXd facing = Eigen::ArrayXd::Zero(count);
  Eigen::ArrayXd seen = facing;
  for (Eigen::Index c = 0; c < number; ++c) {
    if (check.confirmed_by[static_cast<std::size_t>(c)] >= kAgreeing * most) {
      facing += faces.col(c);
      seen += looked.col(c);
      check.blank.array() += blank.col(c);
      check.covered.array() += covered.col(c);
    }
  }
  check.blank.array() += (facing > 0 && seen == 0).cast<double>();
}

namespace {

constexpr double kSteepest = 75 * kDegree;

}  // namespace

SeenDistance seen_distance(const std::vector<DepthCamera>& cameras, const DepthFrame& frame, const TriangleMesh& mesh,
                           double reach) {
  require_frame(cameras, frame);
  SeenDistance seen{Eigen::VectorXd::Zero(mesh.face_count()), Eigen::VectorXi::Zero(mesh.face_count())};
  const double least_cosine = std::cos(kSteepest);
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    const Camera& view = cameras[c].view;
    const DepthImage& image = frame.images[c];
    for (Eigen::Index f = 0; f < mesh.face_count(); ++f) {
      const Vector3 from_eye = mesh.centroids().col(f) - view.eye;
      if (-mesh.normals().col(f).dot(from_eye) < least_cosine * from_eye.norm()) {
        continue;
      }
      const std::optional<ImagePoint> centroid = image_point(cameras[c], mesh.centroids().col(f));
      if (!centroid) {
        continue;
      }
      const Eigen::Vector2d middle = centroid->at.array().floor() + 0.5;
      const auto depth = static_cast<double>(image.depth[centroid->pixel(image.width)]);
      if (depth > 0 && std::abs(depth - centroid->depth) <= reach) {
        // Lenses bend little within a pixel.
        const Eigen::Vector2d seen_ray = centroid->ray + (middle - centroid->at).cwiseQuotient(view.focal);
        const Vector3 point = view.axes * (depth * seen_ray.homogeneous());
        seen.distance(f) += mesh.normals().col(f).dot(point - from_eye);
        ++seen.cameras(f);
      }
    }
  }
  for (Eigen::Index f = 0; f < mesh.face_count(); ++f) {
    seen.distance(f) =
        seen.cameras(f) > 0 ? seen.distance(f) / seen.cameras(f) : std::numeric_limits<double>::quiet_NaN();
  }
  return seen;
}

}  // namespace touchfield
