#pragma once

#include <complex>
#include <vector>

#include <Eigen/Core>

namespace touchfield {

/// Cholesky factorisation A = L L^H in place (blocks of columns by LAPACK's potrf, the rest by BLAS), n x n, column by
/// column without gaps. Only the lower triangle of `a` is read and written. Scalar is float, double or
/// std::complex<double>.
///
/// returns   false where a pivot is not positive to working precision or not finite; `a` then holds nothing of use
template <typename Scalar>
bool cholesky_factorise(int n, Scalar* a);

/// Overwrites b by A^-1 b for the factor that cholesky_factorise left. Scalar is float or double.
template <typename Scalar>
void cholesky_solve(int n, const Scalar* factor, Scalar* b);

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

/// A = vectors diag(values) vectors^H.
struct HermitianEigen {
  Eigen::VectorXd values;    ///< n, ascending
  Eigen::MatrixXcd vectors;  ///< n x n, orthonormal columns
};

/// All eigenvalues and eigenvectors of a Hermitian matrix (LAPACK zheevd); only the lower triangle is read.
///
/// accuracy  values to about n eps ||A||
/// throws    std::invalid_argument if it is not square, std::domain_error if it holds a value that is not finite or the
///           iteration fails
HermitianEigen hermitian_eigen(Eigen::MatrixXcd matrix);

}  // namespace touchfield
