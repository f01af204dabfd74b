#pragma once

// For .cu files only: kernels that give a column to a block of threads.
#include "sim/gpu/cuda/launch.cuh"

namespace touchfield::cuda {

constexpr int kColumnThreads = 512;
constexpr int kWarps = kColumnThreads / kWarp;

/// The sum over a block of kColumnThreads, the same to the bit in all its threads, all of which must call.
__device__ inline double block_sum(double value) {
  __shared__ double of_warps[kWarps];
  const double of_warp = lane_sum<kWarp>(value);
  if (threadIdx.x % kWarp == 0) {
    of_warps[threadIdx.x / kWarp] = of_warp;
  }
  __syncthreads();
  double sum = 0.0;
  for (int warp = 0; warp < kWarps; ++warp) {
    sum += of_warps[warp];
  }
  __syncthreads();  // the next call writes there
  return sum;
}

__device__ inline double square(cuComplex value) {
  const double re = value.x;
  const double im = value.y;
  return re * re + im * im;
}

__device__ inline cuComplex scaled(cuComplex value, double factor) {
  return {static_cast<float>(value.x * factor), static_cast<float>(value.y * factor)};
}

__device__ inline double magnitude(double value) { return fabs(value); }
__device__ inline double magnitude(cuComplex value) { return hypotf(value.x, value.y); }
__device__ inline double magnitude(cuDoubleComplex value) { return hypot(value.x, value.y); }

}  // namespace touchfield::cuda
