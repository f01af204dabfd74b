#pragma once

#include <optional>
#include <vector>

#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

/// How far pressures on a mesh are from those of a judge's mesh of the same body, taken at the mesh's own centroids:
///
///   sqrt( sum A |p - P(x)|^2 / sum A |P(x)|^2 )
///
/// P is the judge's pressure: on the same face, at the middle face of the faces that a face was split into, or fitted
/// to the judge's faces around x (SurfaceFit) where the judge has a mesh of its own. The sums are over the faces that
/// are skin in both.
class JudgeComparison {
 public:
  /// splits   how often the faces of `mesh` were split in four, 0 if not at all; none: a mesh of the judge's own
  /// skin     M: 1 where faces count; empty: everywhere
  /// Both meshes outlive this.
  JudgeComparison(const TriangleMesh& mesh, const TriangleMesh& judge, std::optional<int> splits,
                  std::vector<unsigned char> skin = {});
  JudgeComparison(const TriangleMesh&&, const TriangleMesh&, std::optional<int>,
                  std::vector<unsigned char> = {}) = delete;
  JudgeComparison(const TriangleMesh&, const TriangleMesh&&, std::optional<int>,
                  std::vector<unsigned char> = {}) = delete;

  /// own      M x S [Pa];  judged   Mj x S [Pa]
  /// returns  S differences
  Eigen::VectorXd differences(const Eigen::MatrixXcd& own, const Eigen::MatrixXcd& judged) const;

  /// P at the mesh's centroids, M x S; 0 where faces do not count.
  Eigen::MatrixXcd at_centroids(const Eigen::MatrixXcd& judged) const;

 private:
  const TriangleMesh& mesh_;
  const TriangleMesh& judge_;
  std::optional<int> splits_;
  std::vector<Eigen::Index> counted_;  // faces
};

inline constexpr double kTargetReach = 15e-3;  // [m]

/// The target's surroundings: 1 on faces within kTargetReach of the centroid of a target face, M.
std::vector<unsigned char> target_surroundings(const TriangleMesh& mesh, const std::vector<Eigen::Index>& target_faces);

/// Area-weighted relative L2 difference of a from b.
double relative_difference(const Eigen::VectorXd& areas, const Eigen::VectorXcd& a, const Eigen::VectorXcd& b);

}  // namespace touchfield
