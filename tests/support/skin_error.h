#pragma once

#include <cmath>
#include <numbers>
#include <vector>

#include "sim/cameras/depth_camera.h"
#include "sim/core/require.h"
#include "sim/core/units.h"
#include "sim/mesh/query/surface_fit.h"

namespace touchfield {
inline namespace support {

/// How far a fitted skin is from the true one, where it matters. Only a simulation knows the true skin.
struct SkinError {
  SkinDistance seen;   // from the true skin that some camera sees to the fitted one
  SkinDistance patch;  // from the true skin round a point to the fitted one, seen or not
  SkinDistance all;    // from the whole true skin to the fitted one
  SkinDistance back;   // from the whole fitted skin to the true one: what the fit has too much shows here alone
};                     // in each, positive where the fitted skin is outside of the true one

/// The part of a skin that is evaluated by itself.
struct SkinPatch {
  Vector3 middle;  // [m]
  double radius;   // [m]; faces whose centroid is no farther
};

/// The faces that some camera sees, without distortion. Their centroid is in its image, and the ray to it is within
/// `steepest` of the face's normal. No other face within 1.5 pixels is nearer by more than the depth of such a face.
///
/// steepest   [rad], below pi / 2; cameras have holes in what is steeper than 75 degrees
/// throws     InputError as rasterise does, or if `steepest` is out of its range
inline std::vector<bool> faces_seen(const std::vector<DepthCamera>& cameras, const TriangleMesh& mesh,
                                    double steepest = 75 * kDegree) {
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

/// seen   faces_seen of the true skin
inline SkinError skin_error(const TriangleMesh& truth, const TriangleMesh& fitted, const std::vector<bool>& seen,
                            const SkinPatch& patch) {
  const Eigen::VectorXd distances = signed_distances(truth, fitted);
  std::vector<bool> near(static_cast<std::size_t>(truth.face_count()));
  for (Eigen::Index f = 0; f < truth.face_count(); ++f) {
    near[static_cast<std::size_t>(f)] = (truth.centroids().col(f) - patch.middle).norm() <= patch.radius;
  }
  return {skin_distance(truth, distances, seen), skin_distance(truth, distances, near),
          skin_distance(truth, distances, {}), skin_distance(fitted, -signed_distances(fitted, truth), {})};
}

}  // namespace support
}  // namespace touchfield
