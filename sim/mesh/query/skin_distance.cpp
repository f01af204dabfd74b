#include "sim/mesh/query/skin_distance.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/mesh/query/face_tree.h"

namespace touchfield {

Eigen::VectorXd signed_distances(const TriangleMesh& from, const TriangleMesh& to) {
  const FaceTree tree(to);
  Eigen::VectorXd distances(from.face_count());
#pragma omp parallel for schedule(dynamic, 64)
  for (Eigen::Index f = 0; f < from.face_count(); ++f) {
    const Vector3 x = from.centroids().col(f);
    const Vector3 normal = from.normals().col(f);
    const SkinPoint nearest = tree.nearest_facing(x, normal, 0.0);
    distances(f) = nearest.face < 0 ? std::numeric_limits<double>::quiet_NaN()
                                    : std::copysign(nearest.distance, normal.dot(nearest.at - x));
  }
  return distances;
}

SkinDistance skin_distance(const TriangleMesh& mesh, const Eigen::VectorXd& distances, const std::vector<bool>& keep) {
  if (distances.size() != mesh.face_count() ||
      (!keep.empty() && keep.size() != static_cast<std::size_t>(mesh.face_count()))) {
    throw InputError(fmt::format("skin distance: {} distances and {} choices of {} faces", distances.size(),
                                 keep.size(), mesh.face_count()));
  }
  SkinDistance result;
  std::vector<Eigen::Index> faces;
  for (Eigen::Index f = 0; f < mesh.face_count(); ++f) {
    if (!std::isnan(distances(f)) && (keep.empty() || keep[static_cast<std::size_t>(f)])) {
      faces.push_back(f);
      const double area = mesh.areas()(f);
      result.area += area;
      result.mean += area * distances(f);
      result.rms += area * distances(f) * distances(f);
    }
  }
  if (faces.empty()) {
    return result;
  }
  result.mean /= result.area;
  result.rms = std::sqrt(result.rms / result.area);
  std::ranges::sort(faces, {}, [&](Eigen::Index f) { return std::abs(distances(f)); });
  result.most = std::abs(distances(faces.back()));
  double nearer = 0;
  for (const Eigen::Index f : faces) {
    nearer += mesh.areas()(f);
    result.p95 = std::abs(distances(f));
    if (nearer >= 0.95 * result.area) {
      break;
    }
  }
  return result;
}

}  // namespace touchfield
