#include "sim/cameras/skin_error.h"

#include <cmath>
#include <numbers>

#include "sim/core/require.h"

namespace touchfield {

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
