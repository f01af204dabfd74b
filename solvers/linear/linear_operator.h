#pragma once

#include <complex>
#include <functional>

#include <Eigen/Core>

namespace touchfield {

/// A square complex matrix known by what it does.
class LinearOperator {
 public:
  LinearOperator() = default;
  LinearOperator(const LinearOperator&) = delete;
  LinearOperator& operator=(const LinearOperator&) = delete;
  virtual ~LinearOperator() = default;

  /// n of an n x n operator.
  virtual Eigen::Index size() const = 0;

  /// A X; X is n x S.
  virtual Eigen::MatrixXcd apply(const Eigen::MatrixXcd& x) const = 0;

  /// A^T X, without conjugation.
  virtual Eigen::MatrixXcd apply_transpose(const Eigen::MatrixXcd& x) const = 0;
};

/// What a solver asks of a linear map: A X for an n x S block X of any number of columns S >= 1.
using Product = std::function<Eigen::MatrixXcd(const Eigen::MatrixXcd&)>;

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
