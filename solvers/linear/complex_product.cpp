#include "solvers/linear/complex_product.h"

#include <complex>

namespace touchfield {

void multiply(const Eigen::MatrixXcd& a, const Eigen::Ref<const Eigen::MatrixXcd>& b, CBLAS_TRANSPOSE transpose,
              Eigen::MatrixXcd& c) {
  const std::complex<double> one = 1.0;
  const std::complex<double> zero = 0.0;
  const Eigen::Index columns = transpose == CblasNoTrans ? b.cols() : b.rows();
  c.resize(a.rows(), columns);
  if (c.size() == 0) {
    return;  // which the BLAS refuses
  }
  cblas_zgemm(CblasColMajor, CblasNoTrans, transpose, static_cast<int>(a.rows()), static_cast<int>(columns),
              static_cast<int>(a.cols()), &one, a.data(), static_cast<int>(a.rows()), b.data(),
              static_cast<int>(b.outerStride()), &zero, c.data(), static_cast<int>(c.rows()));
}

}  // namespace touchfield
