#include "sim/gpu/cuda/norm_sums.cuh"
#include "sim/gpu/cuda/normal_factor.cuh"

namespace touchfield::cuda {

namespace {

constexpr int kTile = 64;  // that one block inverts

cusolverStatus_t potrf_space(cusolverDnHandle_t solver, int n, float* a, int* count) {
  return cusolverDnSpotrf_bufferSize(solver, CUBLAS_FILL_MODE_LOWER, n, a, n, count);
}
cusolverStatus_t potrf_space(cusolverDnHandle_t solver, int n, double* a, int* count) {
  return cusolverDnDpotrf_bufferSize(solver, CUBLAS_FILL_MODE_LOWER, n, a, n, count);
}
cusolverStatus_t potrf(cusolverDnHandle_t solver, int n, float* a, float* work, int count, int* info) {
  return cusolverDnSpotrf(solver, CUBLAS_FILL_MODE_LOWER, n, a, n, work, count, info);
}
cusolverStatus_t potrf(cusolverDnHandle_t solver, int n, double* a, double* work, int count, int* info) {
  return cusolverDnDpotrf(solver, CUBLAS_FILL_MODE_LOWER, n, a, n, work, count, info);
}

cublasStatus_t products(cublasHandle_t blas, int m, int n, int k, float alpha, const float* a, int lda,
                        long long next_a, const float* b, int ldb, long long next_b, float* c, int ldc,
                        long long next_c, int count) {
  const float zero = 0;
  return cublasSgemmStridedBatched(blas, CUBLAS_OP_N, CUBLAS_OP_N, m, n, k, &alpha, a, lda, next_a, b, ldb, next_b,
                                   &zero, c, ldc, next_c, count);
}
cublasStatus_t products(cublasHandle_t blas, int m, int n, int k, double alpha, const double* a, int lda,
                        long long next_a, const double* b, int ldb, long long next_b, double* c, int ldc,
                        long long next_c, int count) {
  const double zero = 0;
  return cublasDgemmStridedBatched(blas, CUBLAS_OP_N, CUBLAS_OP_N, m, n, k, &alpha, a, lda, next_a, b, ldb, next_b,
                                   &zero, c, ldc, next_c, count);
}

cublasStatus_t product(cublasHandle_t blas, cublasOperation_t op, int n, const float* a, const float* x, float* y) {
  const float one = 1;
  const float zero = 0;
  return cublasSgemv(blas, op, n, n, &one, a, n, x, 1, &zero, y, 1);
}
cublasStatus_t product(cublasHandle_t blas, cublasOperation_t op, int n, const double* a, const double* x, double* y) {
  const double one = 1;
  const double zero = 0;
  return cublasDgemv(blas, op, n, n, &one, a, n, x, 1, &zero, y, 1);
}

template <typename Real>
__global__ void scale_right(const double* right, double unit, int size, Real* scaled) {
  const int i = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  if (i < size) {
    scaled[i] = static_cast<Real>(right[i] / unit);
  }
}

/// The inverses of the lower triangular tiles on the diagonal: a block a tile, a thread a column of it. Says 1 in info
/// where an entry of the diagonal is not above 0 or not finite.
template <typename Real>
__global__ void invert_tiles(int size, const Real* factor, Real* inverse, int* info) {
  __shared__ Real tile[kTile][kTile + 1];
  const int at = static_cast<int>(blockIdx.x) * kTile;
  const int own = static_cast<int>(threadIdx.x);
  const int count = size - at < kTile ? size - at : kTile;
  for (int j = 0; j < kTile; ++j) {
    const bool inside = own < count && j < count && own >= j;
    tile[own][j] = inside ? factor[at + own + std::size_t{1} * (at + j) * size] : static_cast<Real>(own == j ? 1 : 0);
  }
  __syncthreads();
  const Real pivot = tile[own][own];
  if (!(pivot > 0) || isinf(pivot)) {
    *info = 1;
  }
  Real column[kTile];
#pragma unroll
  for (int i = 0; i < kTile; ++i) {
    Real rest = i == own ? 1 : 0;
#pragma unroll
    for (int k = 0; k < i; ++k) {
      rest -= tile[i][k] * column[k];
    }
    column[i] = rest / tile[i][i];
  }
#pragma unroll
  for (int i = 0; i < kTile; ++i) {
    if (i < count && own < count) {
      inverse[at + i + std::size_t{1} * (at + own) * size] = column[i];
    }
  }
}

}  // namespace

template <typename Real>
Real* NormalFactor<Real>::matrix(int size) {
  const std::size_t entries = std::size_t{1} * size * size;
  matrix_.resize(entries);
  info_.resize(1);
  if (size != size_) {
    inverse_.resize(entries);
    inverse_.set_zero();  // what is above the diagonal's tiles is never written
    between_.resize(entries);
    size_ = size;
  }
  return matrix_.data();
}

template <typename Real>
bool NormalFactor<Real>::factorise() {
  int count = 0;
  check(potrf_space(context_.solver(), size_, matrix_.data(), &count), "Cholesky factor");
  work_.resize(static_cast<std::size_t>(count));
  check(potrf(context_.solver(), size_, matrix_.data(), work_.data(), count, info_.data()), "Cholesky factor");
  invert();
  int* info = static_cast<int*>(context_.staging(sizeof(int)));
  info_.download(info, 1);
  if (*info < 0) {
    throw GpuFailure("graphics card: Cholesky factor: argument " + std::to_string(-*info) + " is refused");
  }
  return *info == 0;
}

/// L^-1 by tiles twice as large each time: that of [L1 0; L21 L2] is [W1 0; -W2 L21 W1, W2].
template <typename Real>
void NormalFactor<Real>::invert() {
  const unsigned tiles = blocks_for(static_cast<std::size_t>(size_), kTile);
  invert_tiles<<<tiles, kTile, 0, context_.stream()>>>(size_, matrix_.data(), inverse_.data(), info_.data());
  context_.launched("inverse of a Cholesky factor");
  const auto at = [&](int row, int column) { return row + std::size_t{1} * column * size_; };
  // L21 (height x width) of `pairs` pairs of tiles from `from` on.
  const auto join = [&](int from, int height, int width, int pairs) {
    const long long next = 2LL * width * (size_ + 1LL);
    const long long next_between = 1LL * width * width;
    const Real one = 1;
    check(products(context_.blas(), height, width, width, one, matrix_.data() + at(from + width, from), size_, next,
                   inverse_.data() + at(from, from), size_, next, between_.data(), width, next_between, pairs),
          "inverse of a Cholesky factor");
    check(products(context_.blas(), height, width, height, -one, inverse_.data() + at(from + width, from + width),
                   size_, next, between_.data(), width, next_between, inverse_.data() + at(from + width, from), size_,
                   next, pairs),
          "inverse of a Cholesky factor");
  };
  for (int width = kTile; width < size_; width *= 2) {
    const int pairs = size_ / (2 * width);
    const int rest = size_ - 2 * width * pairs;
    if (pairs > 0) {
      join(0, width, width, pairs);
    }
    if (rest > width) {
      join(2 * width * pairs, rest - width, width, 1);
    }
  }
}

template <typename Real>
const Real* NormalFactor<Real>::solve(const double* right, double unit) {
  const auto size = static_cast<std::size_t>(size_);
  right_.resize(size);
  half_.resize(size);
  solution_.resize(size);
  scale_right<<<blocks_for(size, kBlock), kBlock, 0, context_.stream()>>>(right, unit, size_, right_.data());
  context_.launched("solution by a Cholesky factor");
  const char* what = "solution by a Cholesky factor";
  check(product(context_.blas(), CUBLAS_OP_N, size_, inverse_.data(), right_.data(), half_.data()), what);
  check(product(context_.blas(), CUBLAS_OP_T, size_, inverse_.data(), half_.data(), solution_.data()), what);
  return solution_.data();
}

template class NormalFactor<float>;
template class NormalFactor<double>;

}  // namespace touchfield::cuda
