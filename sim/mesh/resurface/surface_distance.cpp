#include "sim/mesh/resurface/surface_distance.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "sim/mesh/face_shape.h"

namespace touchfield {

namespace {

using Index = Eigen::Index;

struct Sample {
  Vector3 x;
  Index face;
  double distance;  // negative if it does not count
};

/// Into how many parts each side of a face is cut.
double parts(const TriangleMesh& mesh, Index f, double spacing) { return std::ceil(longest_edge(mesh, f) / spacing); }

double point_count(const TriangleMesh& mesh, double spacing) {
  double count = 0;
  for (Index f = 0; f < mesh.face_count(); ++f) {
    count += std::pow(parts(mesh, f, spacing), 2);
  }
  return count;
}

/// The centroids of the n^2 equal parts of a face.
void add_points(const TriangleMesh& mesh, Index f, int n, std::vector<Sample>& points) {
  const Vector3 a = mesh.corner(f, 0);
  const Vector3 ab = (mesh.corner(f, 1) - a) / n;
  const Vector3 ac = (mesh.corner(f, 2) - a) / n;
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n - i; ++j) {
      points.push_back({a + (i + 1.0 / 3.0) * ab + (j + 1.0 / 3.0) * ac, f, 0});
      if (j < n - i - 1) {
        points.push_back({a + (i + 2.0 / 3.0) * ab + (j + 2.0 / 3.0) * ac, f, 0});
      }
    }
  }
}

}  // namespace

SurfaceDistance surface_distance(const TriangleMesh& from, const FaceTree& to, double spacing,
                                 const std::function<bool(const Vector3& x, const Vector3& normal)>& counts) {
  constexpr double kMostPoints = 2e6;
  // More faces than points: one point each.
  while (point_count(from, spacing) > std::max(kMostPoints, static_cast<double>(from.face_count()))) {
    spacing *= 2.0;
  }
  std::vector<Sample> points;
  std::vector<double> weight(static_cast<std::size_t>(from.face_count()));
  for (Index f = 0; f < from.face_count(); ++f) {
    const double n = std::max(parts(from, f, spacing), 1.0);
    add_points(from, f, static_cast<int>(n), points);
    weight[static_cast<std::size_t>(f)] = from.areas()(f) / (n * n);
  }
#pragma omp parallel for schedule(dynamic, 256)
  for (Sample& point : points) {
    point.distance = counts(point.x, from.normals().col(point.face)) ? to.nearest(point.x).distance : -1.0;
  }
  std::erase_if(points, [](const Sample& point) { return point.distance < 0; });
  std::sort(points.begin(), points.end(), [](const Sample& a, const Sample& b) { return a.distance < b.distance; });
  const auto area_of = [&](const Sample& point) { return weight[static_cast<std::size_t>(point.face)]; };
  double area = 0;
  for (const Sample& point : points) {
    area += area_of(point);
  }
  SurfaceDistance result;
  result.counted = area / from.total_area();
  constexpr double kMost = 0.95;
  double below = 0;
  for (const Sample& point : points) {
    below += area_of(point);
    result.most_of_it = point.distance;
    if (below >= kMost * area) {
      break;
    }
  }
  if (!points.empty()) {
    result.farthest = points.back().distance;
    result.at = points.back().x;
  }
  return result;
}

}  // namespace touchfield
