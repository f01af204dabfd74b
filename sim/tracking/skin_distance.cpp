#include "sim/tracking/skin_distance.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/core/require.h"
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

std::vector<bool> faces_seen(const std::vector<DepthCamera>& cameras, const TriangleMesh& mesh, double steepest) {
  require(steepest > 0 && steepest < 0.5 * std::numbers::pi,
          "faces seen: steepest angle {} rad must be between 0 and pi / 2", steepest);
  std::vector<bool> seen(static_cast<std::size_t>(mesh.face_count()), false);
  for (const DepthCamera& camera : cameras) {
    const Camera& view = camera.view;
    const Raster raster = rasterise(view, mesh.vertices(), mesh.triangles());
    const SeenPoints centroids = seen_points(view, mesh.centroids());
    for (Eigen::Index f = 0; f < mesh.face_count(); ++f) {
      const SeenPoint& at = centroids.col(f);
      const Vector3 towards = (view.eye - mesh.centroids().col(f)).normalized();
      if (at.w() < view.near || mesh.normals().col(f).dot(towards) < std::cos(steepest)) {
        continue;
      }
      const double column = std::floor(at.x() / at.z());
      const double row = std::floor(at.y() / at.z());
      if (column < 0 || row < 0 || column >= view.width || row >= view.height) {
        continue;
      }
      const double slack = 1.5 * at.w() / view.focal.minCoeff() * std::tan(steepest);
      const double nearest = raster.depth[raster.index(static_cast<int>(column), static_cast<int>(row))];
      if (at.w() <= nearest + slack) {
        seen[static_cast<std::size_t>(f)] = true;
      }
    }
  }
  return seen;
}

SkinError skin_error(const TriangleMesh& truth, const TriangleMesh& fitted, const std::vector<bool>& seen,
                     const SkinPatch& patch) {
  const Eigen::VectorXd distances = signed_distances(truth, fitted);
  std::vector<bool> near(static_cast<std::size_t>(truth.face_count()));
  for (Eigen::Index f = 0; f < truth.face_count(); ++f) {
    near[static_cast<std::size_t>(f)] = (truth.centroids().col(f) - patch.middle).norm() <= patch.radius;
  }
  return {skin_distance(truth, distances, seen), skin_distance(truth, distances, near),
          skin_distance(truth, distances, {}), skin_distance(fitted, -signed_distances(fitted, truth), {})};
}

}  // namespace touchfield
