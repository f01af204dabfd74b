#pragma once

#include <Eigen/Core>

#include "sim/bem/boundary_operator.h"
#include "sim/bem/coarse_inverse.h"
#include "sim/bem/coarse_space.h"
#include "sim/bem/surface_filter.h"
#include "solvers/linear/linear_operator.h"

namespace touchfield {

/// A right preconditioner of Burton and Miller's matrix B: (B M) y = b, x = M y,
///
///   M = P E^-1 R + f(L) (1 - P R),   E = B[points, :] P,
///
/// with P, R of CoarseSpace, E^-1 of CoarseInverse and f(L) of SurfaceFilter. GMRES takes some ten steps to 1e-4 on any
/// hand and mesh. The coarse part holds the waves that run between folds, the filter those too short to travel.
class TwoLevel : public LinearOperator {
 public:
  /// parts   of B, with Layer::kBurtonMiller
  /// throws  std::domain_error if E or the mass of the points is singular
  TwoLevel(const TriangleMesh& mesh, const Complex& wavenumber, double coupling, const BoundaryParts& parts);

  const CoarseSpace& coarse() const { return coarse_; }
  Eigen::Index blocks() const { return inverse_.blocks(); }
  double reciprocal_condition() const { return inverse_.reciprocal_condition(); }  // of E, estimated

  Eigen::Index size() const override { return coarse_.faces(); }
  /// M X.
  Eigen::MatrixXcd apply(const Eigen::MatrixXcd& x) const override;
  /// M^T X = R^T (E^-T P^T - P^T f(L)^T) X + f(L)^T X.
  Eigen::MatrixXcd apply_transpose(const Eigen::MatrixXcd& x) const override;

 private:
  CoarseSpace coarse_;
  SurfaceFilter filter_;
  CoarseInverse inverse_;
};

}  // namespace touchfield
