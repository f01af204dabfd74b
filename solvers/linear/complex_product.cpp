#include "solvers/linear/complex_product.h"

#include <complex>

#include <cblas.h>

namespace touchfield {

namespace {

/// c = a op(b), op(b) having `columns` columns.
void product(const Eigen::MatrixXcd& a, const Eigen::Ref<const Eigen::MatrixXcd>& b, CBLAS_TRANSPOSE op,
             Eigen::Index columns, Eigen::MatrixXcd& c) {
  const std::complex<double> one = 1.0;
  const std::complex<double> zero = 0.0;
  c.resize(a.rows(), columns);
  if (c.size() == 0 || a.cols() == 0) {
    c.setZero();
    return;  // which the BLAS may refuse
  }
  cblas_zgemm(CblasColMajor, CblasNoTrans, op, static_cast<int>(a.rows()), static_cast<int>(columns),
              static_cast<int>(a.cols()), &one, a.data(), static_cast<int>(a.rows()), b.data(),
              static_cast<int>(b.outerStride()), &zero, c.data(), static_cast<int>(c.rows()));
}

}  // namespace

void multiply(const Eigen::MatrixXcd& a, const Eigen::Ref<const Eigen::MatrixXcd>& b, Eigen::MatrixXcd& c) {
  product(a, b, CblasNoTrans, b.cols(), c);
}

void multiply_by_adjoint(const Eigen::MatrixXcd& a, const Eigen::Ref<const Eigen::MatrixXcd>& b, Eigen::MatrixXcd& c) {
  product(a, b, CblasConjTrans, b.rows(), c);
}

}  // namespace touchfield
