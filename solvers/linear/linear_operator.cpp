#include "solvers/linear/linear_operator.h"

#include <limits>
#include <stdexcept>
#include <utility>

#include "solvers/linear/blas_product.h"

namespace touchfield {

namespace {

// Up to so many columns reading the matrix anew for each one is faster than GEMM, which first packs it: at two columns
// and n = 6,000 in single precision 71 ms against 118 ms, at four 151 ms against 154 ms (two cores, OpenBLAS 0.3.21).
constexpr Eigen::Index kGemvColumns = 2;

template <typename Real>
Eigen::MatrixXcd product(Op op, const typename DenseOperator<Real>::Matrix& a, const Eigen::MatrixXcd& x) {
  using Matrix = typename DenseOperator<Real>::Matrix;
  if (x.rows() != a.rows()) {
    throw std::invalid_argument("DenseOperator: the block has another number of rows than the matrix");
  }
  const Eigen::Ref<const Matrix> block(x.template cast<std::complex<Real>>());  // no copy in double
  Matrix y = Matrix::Zero(x.rows(), x.cols());
  if (x.cols() <= kGemvColumns) {
    for (Eigen::Index s = 0; s < x.cols(); ++s) {
      multiply(op, a, block.col(s), Real(0), y.col(s));
    }
  } else {
    multiply(op, a, Op::kPlain, block, y);
  }
  return y.template cast<std::complex<double>>();
}

}  // namespace

template <typename Real>
DenseOperator<Real>::DenseOperator(Matrix matrix) : matrix_(std::move(matrix)) {
  if (matrix_.rows() != matrix_.cols() || matrix_.rows() > std::numeric_limits<int>::max()) {
    throw std::invalid_argument("DenseOperator: the matrix must be square");
  }
}

template <typename Real>
Eigen::MatrixXcd DenseOperator<Real>::apply(const Eigen::MatrixXcd& x) const {
  return product<Real>(Op::kPlain, matrix_, x);
}

template <typename Real>
Eigen::MatrixXcd DenseOperator<Real>::apply_transpose(const Eigen::MatrixXcd& x) const {
  return product<Real>(Op::kTransposed, matrix_, x);
}

template class DenseOperator<float>;
template class DenseOperator<double>;

}  // namespace touchfield
