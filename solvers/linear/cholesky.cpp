#include "solvers/linear/cholesky.h"

#include <cmath>
#include <complex>
#include <cstddef>

extern "C" {
// NOLINTBEGIN(readability-identifier-naming): LAPACK's own names; the trailing length is Fortran's for characters.
void spotrf_(const char* uplo, const int* n, float* a, const int* lda, int* info, std::size_t uplo_length);
void dpotrf_(const char* uplo, const int* n, double* a, const int* lda, int* info, std::size_t uplo_length);
void zpotrf_(const char* uplo, const int* n, std::complex<double>* a, const int* lda, int* info,
             std::size_t uplo_length);
void spotrs_(const char* uplo, const int* n, const int* nrhs, const float* a, const int* lda, float* b, const int* ldb,
             int* info, std::size_t uplo_length);
void dpotrs_(const char* uplo, const int* n, const int* nrhs, const double* a, const int* lda, double* b,
             const int* ldb, int* info, std::size_t uplo_length);
// NOLINTEND(readability-identifier-naming)
}

namespace touchfield {

namespace {

constexpr char kLower = 'L';

void potrf(int n, float* a, int* info) { spotrf_(&kLower, &n, a, &n, info, 1); }
void potrf(int n, double* a, int* info) { dpotrf_(&kLower, &n, a, &n, info, 1); }
void potrf(int n, std::complex<double>* a, int* info) { zpotrf_(&kLower, &n, a, &n, info, 1); }

void potrs(int n, int columns, const float* a, float* b, int* info) {
  spotrs_(&kLower, &n, &columns, a, &n, b, &n, info, 1);
}
void potrs(int n, int columns, const double* a, double* b, int* info) {
  dpotrs_(&kLower, &n, &columns, a, &n, b, &n, info, 1);
}

}  // namespace

template <typename Scalar>
bool cholesky_factorise(int n, Scalar* a) {
  int info = 0;
  potrf(n, a, &info);
  // LAPACK may take a NaN for a pivot without a word.
  const auto stride = static_cast<std::size_t>(n) + 1;
  for (std::size_t i = 0; info == 0 && i < static_cast<std::size_t>(n); ++i) {
    if (!std::isfinite(std::real(a[i * stride]))) {
      return false;
    }
  }
  return info == 0;
}

template <typename Scalar>
void cholesky_solve(int n, const Scalar* factor, Scalar* b) {
  int info = 0;
  potrs(n, 1, factor, b, &info);
}

template bool cholesky_factorise(int, float*);
template bool cholesky_factorise(int, double*);
template bool cholesky_factorise(int, std::complex<double>*);
template void cholesky_solve(int, const float*, float*);
template void cholesky_solve(int, const double*, double*);

}  // namespace touchfield
