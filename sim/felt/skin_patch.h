#pragma once

#include <optional>
#include <vector>

#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

/// The skin about a place, laid flat. A face at x with normal n lies in the direction of x - x_0, seen along the normal
/// n_0 of the skin at the middle x_0, at the distance along the skin
///
///   r = |x - x_0| (theta / 2) / sin(theta / 2),   theta the angle between n and n_0
///
/// which is exact round a cylinder and along it, though not between, and from the middle of a sphere.
struct SkinPatch {
  static constexpr double kReach = 12e-3;  // the largest r [m]
  static constexpr double kRim = 2e-3;     // pressure fades out over the last of it [m]

  Eigen::Index face = 0;             // that it is about
  Vector3 middle = Vector3::Zero();  // its centroid [m]
  Eigen::Matrix3d axes;              // columns: the flat x and y axes, n_0
  std::vector<Eigen::Index> faces;   // K, of the mesh, ascending
  Eigen::Matrix2Xd places{};         // of their centroids, 2 x K [m]
  Eigen::VectorXd areas{};           // of the faces on the skin, K [m2]
  Eigen::VectorXd fade{};            // 1, and down to 0 at the rim, K
  std::vector<Eigen::Index> next{};  // pairs of neighbours, numbers among the faces: 2 j and 2 j + 1
  Eigen::VectorXd stretch{};         // of each pair: flat distance of centroids over that along the skin, minus 1

  Eigen::Index size() const { return areas.size(); }
  /// Where a point of the skin lies; nothing beyond kReach, or if no centroid is within an edge length, or 2 mm.
  std::optional<Eigen::Vector2d> place_of(const TriangleMesh& mesh, const Vector3& at) const;
};

/// Columns: along the skin, at right angles to it along the skin, and the unit normal. The first goes towards the
/// world's x axis, or y where x is within 26 degrees of the normal.
Eigen::Matrix3d axes_about(const Vector3& normal);

/// The faces that are joined to a face across edges, as far as kReach.
///
/// accuracy   lengths along and round a cylinder are kept, on a sphere of radius R those round the middle shrink by
///            1 - sin(r / R) / (r / R)
SkinPatch skin_patch(const TriangleMesh& mesh, Eigen::Index face);

/// How much distances on the skin change where the pressure is: the root mean square of the stretch, weighted by area
/// times |pressure|.
///
/// pressure   K
double flattening_error(const SkinPatch& patch, const Eigen::VectorXd& pressure);

}  // namespace touchfield
