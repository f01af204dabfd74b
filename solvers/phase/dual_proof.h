#pragma once

#include <cmath>
#include <limits>
#include <stdexcept>

#include <Eigen/Core>

namespace touchfield {

/// What the proofs of lower bounds share: sums and Hermitian matrices S in double whose rounding is bounded a priori.

/// The most by which a sum of `terms` terms, themselves products of a few, differs from the exact one.
///
/// magnitude   sum of the terms' absolute values
inline double rounding_of_sum(double terms, double magnitude) {
  return 2.0 * std::numeric_limits<double>::epsilon() * (terms + 16.0) * magnitude;
}

/// The most by which the smallest eigenvalue of S, N x N, can lie below 0 although the Cholesky factorisation of what
/// was computed for it went through.
///
/// A completed factorisation is the exact one of another matrix. Each entry differs by at most that of gamma |L||L^H|,
/// of norm <= gamma trace / (1 - gamma). In complex arithmetic gamma <= 8 (n + 4) u whatever the order of the sums. The
/// same holds for the sum of m products that makes each entry of S.
///
/// terms       m
/// magnitude   at least the trace of S, each product in its entries taken by its absolute value
inline double rounding_of_eigenvalue(Eigen::Index channels, Eigen::Index terms, double magnitude) {
  return 4.0 * std::numeric_limits<double>::epsilon() * (static_cast<double>(channels + terms) + 16.0) * magnitude;
}

/// throws   std::domain_error on a value that is not finite
inline void require_finite_value(double value) {
  if (!std::isfinite(value)) {
    throw std::domain_error("optimality bound: the relaxation holds a value that is not finite");
  }
}

/// The first of shift > 0, 2 shift, 4 shift, ... at which is_definite(shift) says yes.
///
/// throws   std::domain_error if there is none
template <class IsDefinite>
double least_shift(const IsDefinite& is_definite, double shift) {
  while (!is_definite(shift)) {
    shift *= 2.0;
    require_finite_value(shift);
  }
  return shift;
}

/// Whether S + diag(diagonal) has a Cholesky factorisation. Only the lower triangle of S counts.
bool is_definite(Eigen::MatrixXcd s, const Eigen::VectorXd& diagonal);

}  // namespace touchfield
