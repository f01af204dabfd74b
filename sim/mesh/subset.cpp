#include "sim/mesh/subset.h"

#include <numeric>

namespace touchfield {

std::vector<Vector3> as_list(const Points& points) {
  const auto columns = points.colwise();
  return {columns.begin(), columns.end()};
}

void drop_unused_points(Points& points, Triangles& triangles) {
  std::vector<int> number(static_cast<std::size_t>(points.cols()), -1);
  for (const int v : triangles.reshaped()) {
    number[static_cast<std::size_t>(v)] = 0;
  }
  int count = 0;
  for (Eigen::Index v = 0; v < points.cols(); ++v) {
    if (int& n = number[static_cast<std::size_t>(v)]; n == 0) {
      points.col(count) = points.col(v).eval();
      n = count++;
    }
  }
  points.conservativeResize(3, count);
  for (int& v : triangles.reshaped()) {
    v = number[static_cast<std::size_t>(v)];
  }
}

FacesRound::FacesRound(const Triangles& triangles, Eigen::Index vertex_count)
    : starts_(static_cast<std::size_t>(vertex_count) + 1, 0), faces_(static_cast<std::size_t>(triangles.size())) {
  for (const int v : triangles.reshaped()) {
    ++starts_[static_cast<std::size_t>(v) + 1];
  }
  std::partial_sum(starts_.begin(), starts_.end(), starts_.begin());
  std::vector<std::size_t> next(starts_.begin(), starts_.end() - 1);
  for (Eigen::Index corner = 0; corner < triangles.size(); ++corner) {
    faces_[next[static_cast<std::size_t>(triangles(corner % 3, corner / 3))]++] = corner / 3;
  }
}

}  // namespace touchfield
