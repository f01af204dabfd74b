#include "sim/gpu/cuda/launch.cuh"
#include "sim/gpu/cuda/normal_factor.cuh"

namespace touchfield::cuda {

namespace {

constexpr int kTile = 64;  // that one block inverts

constexpr auto potrf_space(float /*real*/) { return cusolverDnSpotrf_bufferSize; }
constexpr auto potrf_space(double /*real*/) { return cusolverDnDpotrf_bufferSize; }
constexpr auto potrf(float /*real*/) { return cusolverDnSpotrf; }
constexpr auto potrf(double /*real*/) { return cusolverDnDpotrf; }
constexpr auto rank_update(float /*real*/) { return cublasSsyrk; }
constexpr auto rank_update(double /*real*/) { return cublasDsyrk; }
constexpr auto gemm_batch(float /*real*/) { return cublasSgemmStridedBatched; }
constexpr auto gemm_batch(double /*real*/) { return cublasDgemmStridedBatched; }

template <typename Real>
Real* as(Array<double>& array) {
  return reinterpret_cast<Real*>(array.data());
}

template <typename Real>
__global__ void add_to_diagonal(int size, double mu, Real* matrix) {
  const int i = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  if (i < size) {
    matrix[i * (size + std::size_t{1})] += static_cast<Real>(mu);
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
    if (i < count && own < count) {
      inverse[at + i + std::size_t{1} * (at + own) * size] = column[i];
    }
  }
}

/// scaled = remainder / unit, and y = 0 at first.
template <typename Real>
__global__ void begin_correction(int size, const double* remainder, double unit, bool first, Real* scaled, double* y) {
  const int i = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  if (i < size) {
    scaled[i] = static_cast<Real>(remainder[i] / unit);
    y[i] = first ? 0.0 : y[i];
  }
}

template <typename Real>
__global__ void add_scaled(int size, const Real* scaled, double unit, double* y) {
  const int i = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  if (i < size) {
    y[i] += unit * static_cast<double>(scaled[i]);
  }
}

/// remainder = right - mu y - product, and its norm: one block.
__global__ void __launch_bounds__(kColumnThreads)
    end_correction(int size, const double* right, double mu, const double* y, const double* product, double* remainder,
                   double* norm) {
  double sum = 0;
  for (int i = static_cast<int>(threadIdx.x); i < size; i += kColumnThreads) {
    const double rest = right[i] - mu * y[i] - product[i];
    remainder[i] = rest;
    sum += rest * rest;
  }
  sum = block_sum(sum);
  if (threadIdx.x == 0) {
    *norm = sqrt(sum);
  }
}

}  // namespace

void NormalFactor::resize(int rows, int columns, bool in_double) {
  rows_ = rows;
  columns_ = columns;
  in_double_ = in_double;
  const std::size_t entries = std::size_t{1} * rows * rows;
  const std::size_t given = columns > 0 ? std::size_t{1} * rows * columns : entries;
  exact_.resize(given);
  if (columns > 0 && !in_double) {
    rounded_.resize(given);
  }
  for (Array<double>* array : {&factor_, &inverse_, &between_}) {
    array->resize(in_double ? entries : (entries + 1) / 2);
  }
}

float* NormalFactor::rounded() {
  if (in_double_) {
    return nullptr;
  }
  return columns_ > 0 ? rounded_.data() : as<float>(factor_);
}

bool NormalFactor::factorise(double mu) {
  mu_ = mu;
  return in_double_ ? factorise(mu, exact()) : factorise(mu, rounded());
}

template <typename Real>
bool NormalFactor::factorise(double mu, const Real* given) {
  const char* what = "Cholesky factor";
  auto* factor = as<Real>(factor_);
  if (columns_ > 0) {
    const Real one = 1, zero = 0;
    check(rank_update(Real{})(context_.blas(), CUBLAS_FILL_MODE_LOWER, CUBLAS_OP_N, rows_, columns_, &one, given, rows_,
                              &zero, factor, rows_),
          what);
  } else if (given != factor) {
    check(cudaMemcpyAsync(factor, given, sizeof(Real) * rows_ * rows_, cudaMemcpyDeviceToDevice, context_.stream()),
          what);
  }
  launch(context_, what, add_to_diagonal<Real>, blocks_for(rows_, kBlock), kBlock, rows_, mu, factor);
  int count = 0;
  check(potrf_space(Real{})(context_.solver(), CUBLAS_FILL_MODE_LOWER, rows_, factor, rows_, &count), what);
  work_.resize(static_cast<std::size_t>(count));
  check(potrf(Real{})(context_.solver(), CUBLAS_FILL_MODE_LOWER, rows_, factor, rows_, as<Real>(work_), count,
                      info_.data()),
        what);
  invert<Real>();
  return info_.value(0) == 0;
}

/// L^-1 by tiles twice as large each time: that of [L1 0; L21 L2] is [W1 0; -W2 L21 W1, W2].
template <typename Real>
void NormalFactor::invert() {
  const char* what = "inverse of a Cholesky factor";
  const auto* factor = as<Real>(factor_);
  auto* inverse = as<Real>(inverse_);
  auto* between = as<Real>(between_);
  inverse_.set_zero();
  launch(context_, what, invert_tiles<Real>, blocks_for(rows_, kTile), kTile, rows_, factor, inverse, info_.data());
  const auto at = [&](int row, int column) { return row + std::size_t{1} * column * rows_; };
  // L21 (height x width) of `pairs` pairs of tiles from `from` on.
  const auto join = [&](int from, int height, int width, int pairs) {
    if (height <= 0 || pairs == 0) {
      return;
    }
    const int second = from + width;
    const long long next = 2LL * width * (rows_ + 1LL);
    const long long area = 1LL * width * width;
    const Real one = 1, minus_one = -1, zero = 0;
    check(gemm_batch(Real{})(context_.blas(), CUBLAS_OP_N, CUBLAS_OP_N, height, width, width, &one,
                             factor + at(second, from), rows_, next, inverse + at(from, from), rows_, next, &zero,
                             between, width, area, pairs),
          what);
    check(gemm_batch(Real{})(context_.blas(), CUBLAS_OP_N, CUBLAS_OP_N, height, width, height, &minus_one,
                             inverse + at(second, second), rows_, next, between, width, area, &zero,
                             inverse + at(second, from), rows_, next, pairs),
          what);
  };
  for (int width = kTile; width < rows_; width *= 2) {
    const int pairs = rows_ / (2 * width);
    const int paired = 2 * width * pairs;
    join(0, width, width, pairs);
    join(paired, rows_ - paired - width, width, 1);
  }
}

template <typename Real>
void NormalFactor::add_solution(double unit, bool first) {
  const unsigned blocks = blocks_for(rows_, kBlock);
  const auto* inverse = as<Real>(inverse_);
  auto* scaled = as<Real>(scaled_);
  auto* half = as<Real>(half_);
  const double* remainder = first ? right_.data() : remainder_.data();
  launch(context_, "correction", begin_correction<Real>, blocks, kBlock, rows_, remainder, unit, first, scaled,
         y_.data());
  multiply(context_, inverse, rows_, rows_, rows_, scaled, half);
  multiply_adjoint(context_, inverse, rows_, rows_, rows_, half, scaled);
  launch(context_, "correction", add_scaled<Real>, blocks, kBlock, rows_, scaled, unit, y_.data());
}

double NormalFactor::correct(const double* right, double unit, double* found) {
  const auto rows = static_cast<std::size_t>(rows_);
  for (Array<double>* array : {&scaled_, &half_, &remainder_, &product_}) {
    array->resize(rows);
  }
  y_.resize(rows + 1);
  inner_.resize(static_cast<std::size_t>(columns_) + 1);
  Array<double>& answer = columns_ > 0 ? inner_ : y_;
  const std::size_t count = answer.size() - 1;
  auto* host = static_cast<double*>(context_.staging(sizeof(double) * (std::max(rows, count) + 1)));
  if (right != nullptr) {
    std::memcpy(host, right, sizeof(double) * rows);
    right_.upload(host, rows);
  }
  if (in_double_) {
    add_solution<double>(unit, right != nullptr);
  } else {
    add_solution<float>(unit, right != nullptr);
  }
  if (columns_ > 0) {
    multiply_adjoint(context_, exact(), rows_, rows_, columns_, y_.data(), inner_.data());
  }
  multiply(context_, exact(), rows_, rows_, static_cast<int>(count), answer.data(), product_.data());
  launch(context_, "correction", end_correction, 1, kColumnThreads, rows_, right_.data(), mu_, y_.data(),
         product_.data(), remainder_.data(), answer.data() + count);
  answer.download(host, count + 1);
  std::memcpy(found, host, sizeof(double) * count);
  return host[count];
}

}  // namespace touchfield::cuda
