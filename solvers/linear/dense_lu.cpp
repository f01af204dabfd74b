#include "solvers/linear/dense_lu.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>

extern "C" {
// NOLINTBEGIN(readability-identifier-naming): LAPACK's own names; the trailing lengths are Fortran's for characters.
void cgetrf_(const int* m, const int* n, std::complex<float>* a, const int* lda, int* ipiv, int* info);
void zgetrf_(const int* m, const int* n, std::complex<double>* a, const int* lda, int* ipiv, int* info);
void cgetrs_(const char* trans, const int* n, const int* nrhs, const std::complex<float>* a, const int* lda,
             const int* ipiv, std::complex<float>* b, const int* ldb, int* info, std::size_t trans_length);
void zgetrs_(const char* trans, const int* n, const int* nrhs, const std::complex<double>* a, const int* lda,
             const int* ipiv, std::complex<double>* b, const int* ldb, int* info, std::size_t trans_length);
void cgecon_(const char* norm, const int* n, const std::complex<float>* a, const int* lda, const float* anorm,
             float* rcond, std::complex<float>* work, float* rwork, int* info, std::size_t norm_length);
void zgecon_(const char* norm, const int* n, const std::complex<double>* a, const int* lda, const double* anorm,
             double* rcond, std::complex<double>* work, double* rwork, int* info, std::size_t norm_length);
// NOLINTEND(readability-identifier-naming)
}

namespace touchfield {

namespace {

template <typename Real>
struct Lapack;

template <>
struct Lapack<float> {
  static constexpr auto factorise = cgetrf_;
  static constexpr auto solve = cgetrs_;
  static constexpr auto condition = cgecon_;
};

template <>
struct Lapack<double> {
  static constexpr auto factorise = zgetrf_;
  static constexpr auto solve = zgetrs_;
  static constexpr auto condition = zgecon_;
};

/// 1-norm, summed in double: the sum of a column of finite floats neither overflows nor loses its small terms, so it is
/// finite only if every value is. Throws std::domain_error if one is not.
template <typename Matrix>
double finite_one_norm(const Matrix& matrix) {
  double norm = 0.0;
  bool finite = true;
#pragma omp parallel for reduction(max : norm) reduction(&& : finite)
  for (Eigen::Index j = 0; j < matrix.cols(); ++j) {
    const double sum = matrix.col(j).template cast<std::complex<double>>().cwiseAbs().sum();
    finite = finite && std::isfinite(sum);
    norm = std::max(norm, sum);
  }
  if (!finite) {
    throw std::domain_error("the matrix holds a value that is not finite");
  }
  return norm;
}

}  // namespace

template <typename Real>
BasicDenseLu<Real>::BasicDenseLu(Matrix matrix) : factors_(std::move(matrix)) {
  if (factors_.rows() != factors_.cols() || factors_.rows() > std::numeric_limits<int>::max()) {
    throw std::invalid_argument("DenseLu: the matrix must be square");
  }
  norm_ = static_cast<Real>(finite_one_norm(factors_));
  const int n = static_cast<int>(factors_.rows());
  const int stride = std::max(n, 1);
  pivots_.resize(static_cast<std::size_t>(n));
  int info = 0;
  Lapack<Real>::factorise(&n, &n, factors_.data(), &stride, pivots_.data(), &info);
  if (info > 0) {
    throw std::domain_error("the matrix is singular: pivot " + std::to_string(info) + " is zero");
  }
}

template <typename Real>
typename BasicDenseLu<Real>::Matrix BasicDenseLu<Real>::solve(Matrix b) const {
  return solve_with('N', std::move(b));
}

template <typename Real>
typename BasicDenseLu<Real>::Matrix BasicDenseLu<Real>::solve_transpose(Matrix b) const {
  return solve_with('T', std::move(b));
}

template <typename Real>
typename BasicDenseLu<Real>::Matrix BasicDenseLu<Real>::solve_with(char transpose, Matrix b) const {
  if (b.rows() != factors_.rows()) {
    throw std::invalid_argument("DenseLu: the right-hand side has another number of rows than the matrix");
  }
  const int n = static_cast<int>(factors_.rows());
  const int stride = std::max(n, 1);
  const int columns = static_cast<int>(b.cols());
  int info = 0;
  Lapack<Real>::solve(&transpose, &n, &columns, factors_.data(), &stride, pivots_.data(), b.data(), &stride, &info, 1);
  return b;
}

template <typename Real>
double BasicDenseLu<Real>::reciprocal_condition() const {
  const int n = static_cast<int>(factors_.rows());
  const int stride = std::max(n, 1);
  const char one_norm = '1';
  Real reciprocal = 0;
  std::vector<std::complex<Real>> work(2 * static_cast<std::size_t>(n));
  std::vector<Real> real_work(2 * static_cast<std::size_t>(n));
  int info = 0;
  Lapack<Real>::condition(&one_norm, &n, factors_.data(), &stride, &norm_, &reciprocal, work.data(), real_work.data(),
                          &info, 1);
  return static_cast<double>(reciprocal);
}

template class BasicDenseLu<float>;
template class BasicDenseLu<double>;

}  // namespace touchfield
