#include "solvers/linear/sparse_product.h"

#include <complex>

namespace touchfield {

template <typename Real>
void sparse_product(const Eigen::SparseMatrix<Real, Eigen::RowMajor>& a, const Eigen::MatrixXcd& x,
                    Eigen::MatrixXcd& y) {
  y.resize(a.rows(), x.cols());
#pragma omp parallel for schedule(static)
  for (Eigen::Index i = 0; i < a.rows(); ++i) {
    for (Eigen::Index s = 0; s < x.cols(); ++s) {
      std::complex<double> sum = 0;
      for (typename Eigen::SparseMatrix<Real, Eigen::RowMajor>::InnerIterator it(a, i); it; ++it) {
        sum += static_cast<double>(it.value()) * x(it.col(), s);
      }
      y(i, s) = sum;
    }
  }
}

template void sparse_product(const Eigen::SparseMatrix<float, Eigen::RowMajor>&, const Eigen::MatrixXcd&,
                             Eigen::MatrixXcd&);
template void sparse_product(const Eigen::SparseMatrix<double, Eigen::RowMajor>&, const Eigen::MatrixXcd&,
                             Eigen::MatrixXcd&);

}  // namespace touchfield
