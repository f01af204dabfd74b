#include "solvers/linear/factorisations.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>

#include <cblas.h>

extern "C" {
// NOLINTBEGIN(readability-identifier-naming): LAPACK's own names; the trailing length is Fortran's for characters.
void spotrf_(const char* uplo, const int* n, float* a, const int* lda, int* info, std::size_t uplo_length);
void dpotrf_(const char* uplo, const int* n, double* a, const int* lda, int* info, std::size_t uplo_length);
void zpotrf_(const char* uplo, const int* n, std::complex<double>* a, const int* lda, int* info,
             std::size_t uplo_length);
// NOLINTEND(readability-identifier-naming)
}

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

extern "C" {
// NOLINTNEXTLINE(readability-identifier-naming): LAPACK's own name; the trailing lengths are Fortran's for characters.
void zheevd_(const char* job, const char* triangle, const int* n, std::complex<double>* a, const int* lda, double* w,
             std::complex<double>* work, const int* lwork, double* rwork, const int* lrwork, int* iwork,
             const int* liwork, int* info, std::size_t job_length, std::size_t triangle_length);
}

namespace touchfield {

namespace {

constexpr char kLower = 'L';
constexpr int kBlock = 96;  // columns at a time: a fourth less time than LAPACK's own threads at a size of 1,050

void potrf(int n, float* a, int lda, int* info) { spotrf_(&kLower, &n, a, &lda, info, 1); }
void potrf(int n, double* a, int lda, int* info) { dpotrf_(&kLower, &n, a, &lda, info, 1); }
void potrf(int n, std::complex<double>* a, int lda, int* info) { zpotrf_(&kLower, &n, a, &lda, info, 1); }

/// b (m x n) <- b L^-H
void solve_from_right(int m, int n, const float* l, float* b, int ld) {
  cblas_strsm(CblasColMajor, CblasRight, CblasLower, CblasTrans, CblasNonUnit, m, n, 1.0F, l, ld, b, ld);
}
void solve_from_right(int m, int n, const double* l, double* b, int ld) {
  cblas_dtrsm(CblasColMajor, CblasRight, CblasLower, CblasTrans, CblasNonUnit, m, n, 1.0, l, ld, b, ld);
}
void solve_from_right(int m, int n, const std::complex<double>* l, std::complex<double>* b, int ld) {
  const std::complex<double> one = 1.0;
  cblas_ztrsm(CblasColMajor, CblasRight, CblasLower, CblasConjTrans, CblasNonUnit, m, n, &one, l, ld, b, ld);
}

/// c (m x m) <- c - b b^H, lower triangle
void subtract_square(int m, int n, const float* b, float* c, int ld) {
  cblas_ssyrk(CblasColMajor, CblasLower, CblasNoTrans, m, n, -1.0F, b, ld, 1.0F, c, ld);
}
void subtract_square(int m, int n, const double* b, double* c, int ld) {
  cblas_dsyrk(CblasColMajor, CblasLower, CblasNoTrans, m, n, -1.0, b, ld, 1.0, c, ld);
}
void subtract_square(int m, int n, const std::complex<double>* b, std::complex<double>* c, int ld) {
  cblas_zherk(CblasColMajor, CblasLower, CblasNoTrans, m, n, -1.0, b, ld, 1.0, c, ld);
}

void solve_vector(CBLAS_TRANSPOSE transpose, int n, const float* l, float* b) {
  cblas_strsv(CblasColMajor, CblasLower, transpose, CblasNonUnit, n, l, n, b, 1);
}
void solve_vector(CBLAS_TRANSPOSE transpose, int n, const double* l, double* b) {
  cblas_dtrsv(CblasColMajor, CblasLower, transpose, CblasNonUnit, n, l, n, b, 1);
}

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
    const double sum = matrix.col(j).template cast<std::complex<double>>().cwiseAbs2().cwiseSqrt().sum();
    finite = finite && std::isfinite(sum);
    norm = std::max(norm, sum);
  }
  if (!finite) {
    throw std::domain_error("the matrix holds a value that is not finite");
  }
  return norm;
}

}  // namespace

template <typename Scalar>
bool cholesky_factorise(int n, Scalar* a) {
  const auto at = [&](int row, int column) {
    return a + static_cast<std::size_t>(row) + static_cast<std::size_t>(column) * static_cast<std::size_t>(n);
  };
  for (int k = 0; k < n; k += kBlock) {
    const int width = std::min(kBlock, n - k);
    const int below = n - k - width;
    int info = 0;
    potrf(width, at(k, k), n, &info);
    if (info != 0) {
      return false;
    }
    if (below > 0) {
      solve_from_right(below, width, at(k, k), at(k + width, k), n);
      subtract_square(below, width, at(k + width, k), at(k + width, k + width), n);
    }
  }
  // LAPACK may take a NaN for a pivot without a word.
  for (int i = 0; i < n; ++i) {
    if (!std::isfinite(std::real(*at(i, i)))) {
      return false;
    }
  }
  return true;
}

template <typename Scalar>
void cholesky_solve(int n, const Scalar* factor, Scalar* b) {
  solve_vector(CblasNoTrans, n, factor, b);
  solve_vector(CblasTrans, n, factor, b);
}

template bool cholesky_factorise(int, float*);
template bool cholesky_factorise(int, double*);
template bool cholesky_factorise(int, std::complex<double>*);
template void cholesky_solve(int, const float*, float*);
template void cholesky_solve(int, const double*, double*);

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

HermitianEigen hermitian_eigen(Eigen::MatrixXcd matrix) {
  if (matrix.rows() != matrix.cols() || matrix.rows() > std::numeric_limits<int>::max() / 2) {
    throw std::invalid_argument("hermitian_eigen: the matrix must be square");
  }
  const Eigen::MatrixXcd& a = matrix;
  for (Eigen::Index j = 0; j < a.cols(); ++j) {
    if (!a.col(j).tail(a.rows() - j).allFinite()) {
      throw std::domain_error("hermitian_eigen: the matrix holds a value that is not finite");
    }
  }
  HermitianEigen result{Eigen::VectorXd(matrix.rows()), std::move(matrix)};
  const int n = static_cast<int>(result.values.size());
  if (n == 0) {
    return result;
  }
  const char vectors = 'V';
  const char lower = 'L';
  int info = 0;
  const int query = -1;
  std::complex<double> work_size = 0;
  double real_size = 0;
  int integer_size = 0;
  zheevd_(&vectors, &lower, &n, result.vectors.data(), &n, result.values.data(), &work_size, &query, &real_size, &query,
          &integer_size, &query, &info, 1, 1);
  const int work_length = static_cast<int>(work_size.real());
  const int real_length = static_cast<int>(real_size);
  std::vector<std::complex<double>> work(static_cast<std::size_t>(work_length));
  std::vector<double> real_work(static_cast<std::size_t>(real_length));
  std::vector<int> integer_work(static_cast<std::size_t>(integer_size));
  zheevd_(&vectors, &lower, &n, result.vectors.data(), &n, result.values.data(), work.data(), &work_length,
          real_work.data(), &real_length, integer_work.data(), &integer_size, &info, 1, 1);
  if (info != 0) {
    throw std::domain_error("hermitian_eigen: the iteration did not converge");
  }
  return result;
}

}  // namespace touchfield
