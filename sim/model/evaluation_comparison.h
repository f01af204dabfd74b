#pragma once

#include <optional>
#include <vector>

#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

/// The difference of pressures on a mesh from those on an evaluation mesh of the same body, at the centroids of the
/// former:
///
///   sqrt( sum A |p - P(x)|^2 / sum A |P(x)|^2 )
///
/// P is the evaluation's pressure. On the same mesh it is that of the same face. On a mesh with split faces it is that
/// of the middle face of those that a face was split into. Where the evaluation has a mesh of its own, P is fitted to
/// the evaluation's faces around x (SurfaceFit). The sums are over the faces that are skin in both.
class EvaluationComparison {
 public:
  /// splits   how often the faces of `mesh` were split in four, 0 if not at all; none: a mesh of the evaluation's own
  /// skin     M: 1 where faces count; empty: everywhere
  /// Both meshes outlive this.
  EvaluationComparison(const TriangleMesh& mesh, const TriangleMesh& evaluation, std::optional<int> splits,
                       std::vector<unsigned char> skin = {});
  EvaluationComparison(const TriangleMesh&&, const TriangleMesh&, std::optional<int>,
                       std::vector<unsigned char> = {}) = delete;
  EvaluationComparison(const TriangleMesh&, const TriangleMesh&&, std::optional<int>,
                       std::vector<unsigned char> = {}) = delete;

  /// own      M x S [Pa];  evaluated   Mj x S [Pa]
  /// returns  S differences
  Eigen::VectorXd differences(const Eigen::MatrixXcd& own, const Eigen::MatrixXcd& evaluated) const;

  /// P at the mesh's centroids, M x S; 0 where faces do not count.
  Eigen::MatrixXcd at_centroids(const Eigen::MatrixXcd& evaluated) const;

 private:
  const TriangleMesh& mesh_;
  const TriangleMesh& evaluation_;
  std::optional<int> splits_;
  std::vector<Eigen::Index> counted_;  // faces
};

inline constexpr double kTargetReach = 15e-3;  // [m]

/// The target's surroundings: 1 on faces within kTargetReach of the centroid of a target face, M.
std::vector<unsigned char> target_surroundings(const TriangleMesh& mesh, const std::vector<Eigen::Index>& target_faces);

/// Area-weighted relative L2 difference of a from b.
double relative_difference(const Eigen::VectorXd& areas, const Eigen::VectorXcd& a, const Eigen::VectorXcd& b);

}  // namespace touchfield
