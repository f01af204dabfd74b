#pragma once

#include <vector>

#include <Eigen/Core>

namespace touchfield {

/// LU factorisation with partial pivoting of a dense complex matrix in double precision (LAPACK zgetrf).
class DenseLu {
 public:
  /// matrix    n x n, n < 2^31; overwritten by its factors, so that no second copy is held
  /// throws    std::domain_error if the matrix is exactly singular or holds a value that is not finite,
  ///           std::invalid_argument if it is not square
  explicit DenseLu(Eigen::MatrixXcd matrix);

  Eigen::Index size() const { return factors_.rows(); }

  /// A^-1 B; B is n x S. Throws std::invalid_argument on another number of rows.
  Eigen::MatrixXcd solve(Eigen::MatrixXcd b) const;

  /// A^-T B, without conjugation.
  Eigen::MatrixXcd solve_transpose(Eigen::MatrixXcd b) const;

  /// Estimate of the reciprocal condition number in the 1-norm (LAPACK zgecon).
  double reciprocal_condition() const;

 private:
  Eigen::MatrixXcd solve_with(char transpose, Eigen::MatrixXcd b) const;

  Eigen::MatrixXcd factors_;
  std::vector<int> pivots_;
  double norm_;  // 1-norm of the matrix
};

}  // namespace touchfield
