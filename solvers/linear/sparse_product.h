#pragma once

#include <complex>

#include <Eigen/Core>
#include <Eigen/SparseCore>

namespace touchfield {

/// y = A x for a real sparse matrix and complex columns, summed in double, rows shared among threads. y gets the size
/// that it must have.
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

}  // namespace touchfield
