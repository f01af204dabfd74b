#include "sim/cameras/sight_check.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "sim/cameras/hand_points.h"
#include "sim/core/units.h"

namespace touchfield {

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
        const double squared = (vertices.colwise() - hiding).colwise().squaredNorm().minCoeff();
        covered(v, c) = squared > kOwn * kOwn ? 1 : 0;
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
