#include <algorithm>

#include "sim/gpu/cuda/launch.cuh"
#include "sim/gpu/cuda/two_level.cuh"

namespace touchfield::cuda {

namespace {

constexpr unsigned kThreads = 128;
constexpr std::size_t kPanelBytes = std::size_t{512} << 20U;  // of rows of B at once
constexpr std::size_t kLeastRows = 128;

__global__ void set_identity(int size, cuComplex* matrix) {
  const int i = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  if (i < size) {
    matrix[i + std::size_t{1} * i * size] = {1.0F, 0.0F};
  }
}

}  // namespace

TwoLevel::TwoLevel(const Faces& faces, const Boundary& boundary, double coupling)
    : faces_(faces), context_(faces.context()), coarse_(faces, kMostPoints), filter_(faces, coupling) {
  const int size = coarse_.size();
  const std::size_t fitting = std::max(kLeastRows, kPanelBytes / (sizeof(cuComplex) * faces.size()));
  const int rows = std::min(size, static_cast<int>(fitting));
  Array<cuComplex> panel(context_, std::size_t{1} * rows * faces.size());
  Array<cuComplex> matrix(context_, std::size_t{1} * size * size);
  for (int first = 0; first < size; first += rows) {
    const int taken = std::min(rows, size - first);
    boundary.fill_rows({first, taken, coarse_.points()}, panel.data(), rows);
    coarse_.multiply_rows(first, taken, panel.data(), rows, matrix.data());
  }
  panel.reset();
  invert(matrix, coarse_inverse_);
  coarse_.fill_mass(matrix.data());
  invert(matrix, mass_inverse_);
}

void TwoLevel::invert(Array<cuComplex>& matrix, Array<cuComplex>& inverse) {
  const int size = coarse_.size();
  inverse.resize(matrix.size());
  inverse.set_zero();
  launch(context_, "inverse", set_identity, blocks_for(size, kThreads), kThreads, size, inverse.data());
  Lu lu(context_);
  lu.factorise(size, matrix.data());
  lu.solve(CUBLAS_OP_N, size, inverse.data());
}

void TwoLevel::solve(const Array<cuComplex>& inverse, cublasOperation_t op, const cuComplex* c, int columns,
                     cuComplex* out) {
  const int size = coarse_.size();
  multiply(context_, op, CUBLAS_OP_N, size, columns, size, kOne, inverse.data(), size, c, size, kZero, out, size,
           Arithmetic::kSingle);
}

void TwoLevel::apply(bool transposed, const cuComplex* x, int columns, cuComplex* y) {
  const std::size_t of_points = std::size_t{1} * coarse_.size() * columns;
  first_.resize(of_points);
  second_.resize(of_points);
  if (!transposed) {
    rest_.resize(std::size_t{1} * faces_.size() * columns);
    coarse_.gather(true, x, columns, first_.data());
    solve(mass_inverse_, CUBLAS_OP_N, first_.data(), columns, second_.data());
    coarse_.add_interpolated(false, -1.0F, second_.data(), columns, x, rest_.data());
    filter_.apply(false, rest_.data(), columns, y);
    solve(coarse_inverse_, CUBLAS_OP_N, second_.data(), columns, first_.data());
    coarse_.add_interpolated(false, 1.0F, first_.data(), columns, y, y);
    return;
  }
  // R^T (E^-T P^T x - P^T w) + w, w = f(L)^T x
  filter_.apply(true, x, columns, y);
  coarse_.gather(false, x, columns, first_.data());
  solve(coarse_inverse_, CUBLAS_OP_T, first_.data(), columns, second_.data());
  coarse_.gather(false, y, columns, first_.data());
  add(context_, kMinusOne, first_.data(), second_.data(), of_points);
  solve(mass_inverse_, CUBLAS_OP_T, second_.data(), columns, first_.data());
  coarse_.add_interpolated(true, 1.0F, first_.data(), columns, y, y);
}

}  // namespace touchfield::cuda
