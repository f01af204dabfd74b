#pragma once

#include <complex>
#include <vector>

#include <Eigen/Core>

namespace touchfield {

/// LU factorisation with partial pivoting of a dense complex matrix (LAPACK cgetrf or zgetrf). Real is float or double.
template <typename Real>
class BasicDenseLu {
 public:
  using Matrix = Eigen::Matrix<std::complex<Real>, Eigen::Dynamic, Eigen::Dynamic>;

  /// matrix    n x n, n < 2^31; overwritten by its factors, so that no second copy is held
  /// throws    std::domain_error if the matrix is exactly singular or holds a value that is not finite,
  ///           std::invalid_argument if it is not square
  explicit BasicDenseLu(Matrix matrix);

  Eigen::Index size() const { return factors_.rows(); }

  /// A^-1 B; B is n x S. Throws std::invalid_argument on another number of rows.
  Matrix solve(Matrix b) const;

  /// A^-T B, without conjugation.
  Matrix solve_transpose(Matrix b) const;

  /// Estimate of the reciprocal condition number in the 1-norm (LAPACK cgecon or zgecon).
  double reciprocal_condition() const;

 private:
  Matrix solve_with(char transpose, Matrix b) const;

  Matrix factors_;
  std::vector<int> pivots_;
  Real norm_;  // 1-norm of the matrix
};

extern template class BasicDenseLu<float>;
extern template class BasicDenseLu<double>;

using DenseLu = BasicDenseLu<double>;
using DenseLuSingle = BasicDenseLu<float>;

}  // namespace touchfield
