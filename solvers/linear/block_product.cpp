#include "solvers/linear/block_product.h"

#include <cblas.h>

namespace touchfield {

namespace {

void gemm(int p, int s, int k, const std::complex<float>* a, int lda, const std::complex<float>* b, int ldb,
          std::complex<float>* c, int ldc) {
  const std::complex<float> one = 1.0F;
  const std::complex<float> zero = 0.0F;
  cblas_cgemm(CblasColMajor, CblasTrans, CblasNoTrans, p, s, k, &one, a, lda, b, ldb, &zero, c, ldc);
}

void gemm(int p, int s, int k, const std::complex<double>* a, int lda, const std::complex<double>* b, int ldb,
          std::complex<double>* c, int ldc) {
  const std::complex<double> one = 1.0;
  const std::complex<double> zero = 0.0;
  cblas_zgemm(CblasColMajor, CblasTrans, CblasNoTrans, p, s, k, &one, a, lda, b, ldb, &zero, c, ldc);
}

}  // namespace

template <typename Real>
void transposed_product(const Eigen::Matrix<std::complex<Real>, Eigen::Dynamic, Eigen::Dynamic>& a, Eigen::Index k,
                        Eigen::Index p, const std::complex<Real>* b, Eigen::Index stride, Eigen::Index s,
                        Eigen::Matrix<std::complex<Real>, Eigen::Dynamic, Eigen::Dynamic>& c) {
  gemm(static_cast<int>(p), static_cast<int>(s), static_cast<int>(k), a.data(), static_cast<int>(a.rows()), b,
       static_cast<int>(stride), c.data(), static_cast<int>(c.rows()));
}

template void transposed_product<float>(const Eigen::MatrixXcf&, Eigen::Index, Eigen::Index, const std::complex<float>*,
                                        Eigen::Index, Eigen::Index, Eigen::MatrixXcf&);
template void transposed_product<double>(const Eigen::MatrixXcd&, Eigen::Index, Eigen::Index,
                                         const std::complex<double>*, Eigen::Index, Eigen::Index, Eigen::MatrixXcd&);

}  // namespace touchfield
