#include "sim/mesh/repair/surface_distance.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "sim/mesh/face_shape.h"
#include "sim/mesh/query/skin_patches.h"

namespace touchfield {

namespace {

using Index = Eigen::Index;

double piece_count(const TriangleMesh& mesh, double longest) {
  double count = 0;
  for (Index f = 0; f < mesh.face_count(); ++f) {
    count += std::pow(std::ceil(longest_edge(mesh, f) / longest), 2);
  }
  return count;
}

}  // namespace

SurfaceDistance surface_distance(const TriangleMesh& from, const FaceTree& to, double spacing,
                                 const std::function<bool(const Vector3& x, const Vector3& normal)>& counts) {
  constexpr double kMostPoints = 1e6;
  // More faces than points: one point each.
  while (piece_count(from, spacing) > std::max(kMostPoints, static_cast<double>(from.face_count()))) {
    spacing *= 2.0;
  }
  const SkinPatches pieces = pieces_of(from, spacing, 0);
  const Points points = pieces.centres();
  const Points normals = pieces.normals();
  Eigen::VectorXd distances(pieces.size());
#pragma omp parallel for schedule(dynamic, 256)
  for (Index i = 0; i < pieces.size(); ++i) {
    distances(i) = counts(points.col(i), normals.col(i)) ? to.nearest(points.col(i)).distance : -1.0;
  }
  std::vector<Index> order;
  double area = 0;
  for (Index i = 0; i < pieces.size(); ++i) {
    if (distances(i) >= 0) {
      order.push_back(i);
      area += pieces.areas(i);
    }
  }
  std::ranges::stable_sort(order, {}, [&](Index i) { return distances(i); });
  SurfaceDistance result;
  result.counted = area / from.total_area();
  constexpr double kMost = 0.95;
  double below = 0;
  for (const Index i : order) {
    below += pieces.areas(i);
    result.most_of_it = distances(i);
    if (below >= kMost * area) {
      break;
    }
  }
  if (!order.empty()) {
    result.farthest = distances(order.back());
    result.at = points.col(order.back());
  }
  return result;
}

}  // namespace touchfield
