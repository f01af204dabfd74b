#include "solvers/linear/blas_product.h"

#include <algorithm>
#include <complex>
#include <stdexcept>

#include <cblas.h>

namespace touchfield {

namespace {

constexpr Eigen::Index kStrip =
    128;  // columns a thread computes at once: large enough for GEMM, small enough to balance

CBLAS_TRANSPOSE blas(Op op) {
  return op == Op::kPlain ? CblasNoTrans : op == Op::kTransposed ? CblasTrans : CblasConjTrans;
}

template <typename Scalar>
using Matrix = Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic>;

int stride_of(const auto& a) { return static_cast<int>(std::max<Eigen::Index>(a.outerStride(), 1)); }

template <typename Scalar, typename Gemm>
void gemm(Gemm blas_gemm, Op op_a, const Eigen::Ref<const Matrix<Scalar>>& a, Op op_b,
          const Eigen::Ref<const Matrix<Scalar>>& b, Eigen::Ref<Matrix<Scalar>>& c) {
  const Scalar one = 1;
  const Scalar zero = 0;
  const Eigen::Index inner = op_a == Op::kPlain ? a.cols() : a.rows();
  if (c.size() == 0 || inner == 0) {
    c.setZero();
    return;  // which the BLAS may refuse
  }
  blas_gemm(CblasColMajor, blas(op_a), blas(op_b), static_cast<int>(c.rows()), static_cast<int>(c.cols()),
            static_cast<int>(inner), &one, a.data(), stride_of(a), b.data(), stride_of(b), &zero, c.data(),
            stride_of(c));
}

template <typename Scalar, typename Gemv>
void gemv(Gemv blas_gemv, Op op, const Eigen::Ref<const Matrix<Scalar>>& a, const Scalar* x, Scalar beta, Scalar* y) {
  const Scalar one = 1;
  blas_gemv(CblasColMajor, blas(op), static_cast<int>(a.rows()), static_cast<int>(a.cols()), &one, a.data(),
            stride_of(a), x, 1, &beta, y, 1);
}

/// The columns of a product in strips, each by one thread: take(at, width) for each.
template <typename Take>
void for_strips(Eigen::Index columns, const Take& take) {
  const Eigen::Index strips = (columns + kStrip - 1) / kStrip;
  // The last ones first: of a triangle they are the longest, so that the others balance the load.
#pragma omp parallel for schedule(dynamic)
  for (Eigen::Index i = 0; i < strips; ++i) {
    const Eigen::Index at = (strips - 1 - i) * kStrip;
    take(at, std::min(kStrip, columns - at));
  }
}

}  // namespace

void multiply(Op op_a, const Eigen::Ref<const Eigen::MatrixXcd>& a, Op op_b,
              const Eigen::Ref<const Eigen::MatrixXcd>& b, Eigen::Ref<Eigen::MatrixXcd> c) {
  gemm<std::complex<double>>(cblas_zgemm, op_a, a, op_b, b, c);
}

void multiply(Op op_a, const Eigen::Ref<const Eigen::MatrixXcf>& a, Op op_b,
              const Eigen::Ref<const Eigen::MatrixXcf>& b, Eigen::Ref<Eigen::MatrixXcf> c) {
  gemm<std::complex<float>>(cblas_cgemm, op_a, a, op_b, b, c);
}

void multiply(Op op, const Eigen::Ref<const Eigen::MatrixXcd>& a, const Eigen::Ref<const Eigen::VectorXcd>& x,
              double beta, Eigen::Ref<Eigen::VectorXcd> y) {
  gemv<std::complex<double>>(cblas_zgemv, op, a, x.data(), beta, y.data());
}

void multiply(Op op, const Eigen::Ref<const Eigen::MatrixXcf>& a, const Eigen::Ref<const Eigen::VectorXcf>& x,
              float beta, Eigen::Ref<Eigen::VectorXcf> y) {
  gemv<std::complex<float>>(cblas_cgemv, op, a, x.data(), beta, y.data());
}

void multiply(const Eigen::MatrixXcd& a, const Eigen::Ref<const Eigen::MatrixXcd>& b, Eigen::MatrixXcd& c) {
  c.resize(a.rows(), b.cols());
  multiply(Op::kPlain, a, Op::kPlain, b, c);
}

void multiply_by_adjoint(const Eigen::MatrixXcd& a, const Eigen::Ref<const Eigen::MatrixXcd>& b, Eigen::MatrixXcd& c) {
  c.resize(a.rows(), b.rows());
  multiply(Op::kPlain, a, Op::kAdjoint, b, c);
}

Eigen::MatrixXcd matrix_product(const Eigen::MatrixXcd& a, const Eigen::MatrixXcd& b) {
  if (a.cols() != b.rows()) {
    throw std::invalid_argument("matrix_product: the columns of the first are not as many as the rows of the second");
  }
  Eigen::MatrixXcd c;
  multiply(a, b, c);
  return c;
}

Eigen::MatrixXcd hermitian_product(const Eigen::MatrixXcd& a) {
  Eigen::MatrixXcd c = Eigen::MatrixXcd::Zero(a.cols(), a.cols());
  for_strips(a.cols(), [&](Eigen::Index at, Eigen::Index width) {
    const Eigen::Index rows = at + width;
    multiply(Op::kAdjoint, a.leftCols(rows), Op::kPlain, a.middleCols(at, width), c.block(0, at, rows, width));
  });
  c.triangularView<Eigen::StrictlyLower>() = c.adjoint();
  c.diagonal() = c.diagonal().real().cast<std::complex<double>>();
  return c;
}

Eigen::MatrixXcd adjoint_product(const Eigen::MatrixXcd& a, const Eigen::MatrixXcd& b) {
  if (a.rows() != b.rows()) {
    throw std::invalid_argument("adjoint_product: the matrices have different numbers of rows");
  }
  Eigen::MatrixXcd c(a.cols(), b.cols());
  for_strips(b.cols(), [&](Eigen::Index at, Eigen::Index width) {
    multiply(Op::kAdjoint, a, Op::kPlain, b.middleCols(at, width), c.middleCols(at, width));
  });
  return c;
}

}  // namespace touchfield
