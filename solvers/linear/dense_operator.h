#pragma once

#include <complex>

#include <Eigen/Core>

#include "solvers/linear/linear_operator.h"

namespace touchfield {

/// A stored matrix, multiplied by BLAS; Real, float or double, is the precision of its entries and of the arithmetic.
/// A block is rounded to Real before the product, so its values must be in Real's range.
template <typename Real>
class DenseOperator : public LinearOperator {
 public:
  using Matrix = Eigen::Matrix<std::complex<Real>, Eigen::Dynamic, Eigen::Dynamic>;

  /// matrix    n x n, n < 2^31
  /// throws    std::invalid_argument if it is not square
  explicit DenseOperator(Matrix matrix);

  const Matrix& matrix() const { return matrix_; }

  Eigen::Index size() const override { return matrix_.rows(); }

  /// A X; X is n x S, S < 2^31. Throws std::invalid_argument on another number of rows.
  Eigen::MatrixXcd apply(const Eigen::MatrixXcd& x) const override;

  /// A^T X, without conjugation.
  Eigen::MatrixXcd apply_transpose(const Eigen::MatrixXcd& x) const override;

 private:
  Matrix matrix_;
};

extern template class DenseOperator<float>;
extern template class DenseOperator<double>;

}  // namespace touchfield
