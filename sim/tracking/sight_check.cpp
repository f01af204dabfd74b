#include "sim/tracking/sight_check.h"

#include <algorithm>
#include <cmath>

namespace touchfield {

namespace {

constexpr double kTowards = 0.34;  // cosine between normal and ray
constexpr double kEdge = 3;        // that an edge is off [pixels]

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

}  // namespace

void check_sight(const std::vector<DepthCamera>& cameras, const DepthFrame& frame, const Points& vertices,
                 const Points& normals, double tolerance, double baseline, SightCheck& check) {
  check.confirmed.setZero(vertices.cols());
  check.refuted.setZero(vertices.cols());
  check.confirmed_by.assign(cameras.size(), 0);
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    const DepthImage& image = frame.images[c];
    for (Eigen::Index v = 0; v < vertices.cols(); ++v) {
      const Vector3 from_eye = vertices.col(v) - cameras[c].view.eye;
      if (-normals.col(v).dot(from_eye) < kTowards * from_eye.norm()) {
        continue;
      }
      const std::optional<ImagePoint> point = image_point(cameras[c], vertices.col(v));
      if (!point) {
        continue;
      }
      const auto column = static_cast<int>(point->at.x());
      const auto row = static_cast<int>(point->at.y());
      const double depth = depth_round(image, column, row);
      if (depth > 0 && std::abs(depth - point->depth) <= tolerance) {
        check.confirmed(v) += 1;
        ++check.confirmed_by[c];
      } else if (depth > point->depth ||
                 (depth == 0 && !hidden_from_second_eye(image, column, row, point->depth, tolerance,
                                                        cameras[c].view.focal.x() * baseline))) {
        check.refuted(v) += 1;
      }
    }
  }
}

}  // namespace touchfield
