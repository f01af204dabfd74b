#include "sim/bem/two_level.h"

namespace touchfield {

TwoLevel::TwoLevel(const TriangleMesh& mesh, const Complex& wavenumber, double coupling, const BoundaryParts& parts)
    : coarse_(mesh, wavenumber.real()),
      filter_(mesh, wavenumber, coupling),
      inverse_(mesh, wavenumber, parts, coarse_) {}

Eigen::MatrixXcd TwoLevel::apply(const Eigen::MatrixXcd& x) const {
  const Eigen::MatrixXcd r = coarse_.projected(x);
  return coarse_.interpolated(inverse_.solve(r)) + filter_.apply(x - coarse_.interpolated(r));
}

Eigen::MatrixXcd TwoLevel::apply_transpose(const Eigen::MatrixXcd& x) const {
  const Eigen::MatrixXcd w = filter_.apply_transpose(x);
  return w + coarse_.projected_transpose(inverse_.solve_transpose(coarse_.gathered(x)) - coarse_.gathered(w));
}

}  // namespace touchfield
