#include "solvers/linear/hermitian_product.h"

#include <algorithm>
#include <complex>
#include <stdexcept>

#include <cblas.h>

#include "solvers/linear/complex_product.h"

namespace touchfield {

namespace {

constexpr Eigen::Index kStrip =
    128;  // columns a thread computes at once: large enough for GEMM, small enough to balance

/// c(rows 0..rows-1, cols at..at+width-1) = A(:, 0..rows-1)^H B(:, at..at+width-1). Inside a parallel region OpenBLAS
/// runs on the calling thread.
void block_product(const Eigen::MatrixXcd& a, const Eigen::MatrixXcd& b, Eigen::Index rows, Eigen::Index at,
                   Eigen::Index width, Eigen::MatrixXcd& c) {
  const std::complex<double> one = 1.0;
  const std::complex<double> zero = 0.0;
  cblas_zgemm(CblasColMajor, CblasConjTrans, CblasNoTrans, static_cast<int>(rows), static_cast<int>(width),
              static_cast<int>(a.rows()), &one, a.data(), static_cast<int>(a.rows()), b.data() + at * b.rows(),
              static_cast<int>(b.rows()), &zero, c.data() + at * c.rows(), static_cast<int>(c.rows()));
}

}  // namespace

Eigen::MatrixXcd hermitian_product(const Eigen::MatrixXcd& a) {
  const Eigen::Index n = a.cols();
  Eigen::MatrixXcd c = Eigen::MatrixXcd::Zero(n, n);
  if (a.size() == 0) {
    return c;
  }
  const Eigen::Index blocks = (n + kStrip - 1) / kStrip;
  // The widest blocks first, so that the last ones balance the load.
#pragma omp parallel for schedule(dynamic)
  for (Eigen::Index i = 0; i < blocks; ++i) {
    const Eigen::Index at = (blocks - 1 - i) * kStrip;
    const Eigen::Index width = std::min(kStrip, n - at);
    block_product(a, a, at + width, at, width, c);
  }
  c.triangularView<Eigen::StrictlyLower>() = c.adjoint();
  c.diagonal() = c.diagonal().real().cast<std::complex<double>>();
  return c;
}

Eigen::MatrixXcd adjoint_product(const Eigen::MatrixXcd& a, const Eigen::MatrixXcd& b) {
  if (a.rows() != b.rows()) {
    throw std::invalid_argument("adjoint_product: the matrices have different numbers of rows");
  }
  Eigen::MatrixXcd c = Eigen::MatrixXcd::Zero(a.cols(), b.cols());
  if (a.size() == 0 || b.size() == 0) {
    return c;
  }
  const Eigen::Index blocks = (b.cols() + kStrip - 1) / kStrip;
#pragma omp parallel for schedule(dynamic)
  for (Eigen::Index i = 0; i < blocks; ++i) {
    const Eigen::Index at = i * kStrip;
    block_product(a, b, a.cols(), at, std::min(kStrip, b.cols() - at), c);
  }
  return c;
}

Eigen::MatrixXcd matrix_product(const Eigen::MatrixXcd& a, const Eigen::MatrixXcd& b) {
  if (a.cols() != b.rows()) {
    throw std::invalid_argument("matrix_product: the columns of the first are not as many as the rows of the second");
  }
  Eigen::MatrixXcd c;
  multiply(a, b, c);
  return c;
}

}  // namespace touchfield
