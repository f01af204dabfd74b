#pragma once

// For .cu files only: the 1-norm of a matrix, which is finite only if every value is.
#include <cmath>

#include "sim/gpu/cuda/block_sum.cuh"

namespace touchfield::cuda {

inline __device__ double magnitude(double value) { return fabs(value); }
inline __device__ double magnitude(cuComplex value) { return hypotf(value.x, value.y); }
inline __device__ double magnitude(cuDoubleComplex value) { return hypot(value.x, value.y); }

template <typename Complex>
__global__ void __launch_bounds__(kColumnThreads) sum_columns(int n, const Complex* a, bool lower, double* sums) {
  const int column = static_cast<int>(blockIdx.x);
  double sum = 0.0;
  for (int row = static_cast<int>(threadIdx.x) + (lower ? column : 0); row < n; row += kColumnThreads) {
    sum += magnitude(a[static_cast<std::size_t>(column) * n + row]);
  }
  sum = block_sum(sum);
  if (threadIdx.x == 0) {
    sums[column] = sum;
  }
}

/// max_j sum_i |a_ij| of an n x n matrix, n > 0, or of its lower triangle; not finite if a value of it is not.
template <typename Complex>
double greatest_column_sum(Context& context, int n, const Complex* a, bool lower, Array<double>& sums) {
  sums.resize(static_cast<std::size_t>(n));
  sum_columns<<<static_cast<unsigned>(n), kColumnThreads, 0, context.stream()>>>(n, a, lower, sums.data());
  context.launched("norm of a matrix");
  auto* landed = static_cast<double*>(context.staging(sums.size() * sizeof(double)));
  sums.download(landed, sums.size());
  double greatest = 0.0;
  for (std::size_t j = 0; j < sums.size(); ++j) {
    greatest = landed[j] > greatest || std::isnan(landed[j]) ? landed[j] : greatest;
  }
  return greatest;
}

}  // namespace touchfield::cuda
