#pragma once

#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

/// How far pressures on a mesh are from those of a judge's mesh of the same body, taken at the mesh's own centroids:
///
///   sqrt( sum A |p - P(x)|^2 / sum A |P(x)|^2 )
///
/// P is the judge's pressure: at the middle face of the faces that a face was split into, or fitted to the judge's
/// faces around x (SurfaceFit) where the judge has a mesh of its own.
class JudgeComparison {
 public:
  /// splits   how often the judge's mesh was split off `mesh`; 0: a mesh of its own
  JudgeComparison(const TriangleMesh& mesh, const TriangleMesh& judge, int splits);

  /// own      M x S [Pa];  judged   Mj x S [Pa]
  /// returns  S differences
  Eigen::VectorXd differences(const Eigen::MatrixXcd& own, const Eigen::MatrixXcd& judged) const;

  /// P at the mesh's centroids, M x S.
  Eigen::MatrixXcd at_centroids(const Eigen::MatrixXcd& judged) const;

 private:
  const TriangleMesh& mesh_;
  const TriangleMesh& judge_;
  int splits_;
};

/// Area-weighted relative L2 difference of a from b.
double relative_difference(const Eigen::VectorXd& areas, const Eigen::VectorXcd& a, const Eigen::VectorXcd& b);

}  // namespace touchfield
