#include "solvers/linear/dense_lu.h"

#include <cmath>
#include <complex>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>

extern "C" {
// NOLINTBEGIN(readability-identifier-naming): LAPACK's own names; the trailing lengths are Fortran's for characters.
void zgetrf_(const int* m, const int* n, std::complex<double>* a, const int* lda, int* ipiv, int* info);
void zgetrs_(const char* trans, const int* n, const int* nrhs, const std::complex<double>* a, const int* lda,
             const int* ipiv, std::complex<double>* b, const int* ldb, int* info, std::size_t trans_length);
void zgecon_(const char* norm, const int* n, const std::complex<double>* a, const int* lda, const double* anorm,
             double* rcond, std::complex<double>* work, double* rwork, int* info, std::size_t norm_length);
// NOLINTEND(readability-identifier-naming)
}

namespace touchfield {

DenseLu::DenseLu(Eigen::MatrixXcd matrix) : factors_(std::move(matrix)) {
  if (factors_.rows() != factors_.cols() || factors_.rows() > std::numeric_limits<int>::max()) {
    throw std::invalid_argument("DenseLu: the matrix must be square");
  }
  norm_ = factors_.size() > 0 ? factors_.cwiseAbs().colwise().sum().maxCoeff() : 0.0;
  // A NaN in one column need not survive maxCoeff, but it does survive a sum.
  const std::complex<double> total = factors_.sum();
  if (!std::isfinite(total.real()) || !std::isfinite(total.imag())) {
    throw std::domain_error("the matrix holds a value that is not finite");
  }
  const int n = static_cast<int>(factors_.rows());
  pivots_.resize(static_cast<std::size_t>(n));
  int info = 0;
  zgetrf_(&n, &n, factors_.data(), &n, pivots_.data(), &info);
  if (info > 0) {
    throw std::domain_error("the matrix is singular: pivot " + std::to_string(info) + " is zero");
  }
}

Eigen::MatrixXcd DenseLu::solve(Eigen::MatrixXcd b) const { return solve_with('N', std::move(b)); }

Eigen::MatrixXcd DenseLu::solve_transpose(Eigen::MatrixXcd b) const { return solve_with('T', std::move(b)); }

Eigen::MatrixXcd DenseLu::solve_with(char transpose, Eigen::MatrixXcd b) const {
  if (b.rows() != factors_.rows()) {
    throw std::invalid_argument("DenseLu: the right-hand side has another number of rows than the matrix");
  }
  const int n = static_cast<int>(factors_.rows());
  const int columns = static_cast<int>(b.cols());
  int info = 0;
  zgetrs_(&transpose, &n, &columns, factors_.data(), &n, pivots_.data(), b.data(), &n, &info, 1);
  return b;
}

double DenseLu::reciprocal_condition() const {
  const int n = static_cast<int>(factors_.rows());
  const char one_norm = '1';
  double reciprocal = 0.0;
  std::vector<std::complex<double>> work(2 * static_cast<std::size_t>(n));
  std::vector<double> real_work(2 * static_cast<std::size_t>(n));
  int info = 0;
  zgecon_(&one_norm, &n, factors_.data(), &n, &norm_, &reciprocal, work.data(), real_work.data(), &info, 1);
  return reciprocal;
}

}  // namespace touchfield
