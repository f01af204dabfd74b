#pragma once

// For .cu files only: kernels that give a column of a block to a block of threads.
#include "sim/gpu/cuda/context.cuh"

namespace touchfield::cuda {

constexpr int kColumnThreads = 512;
constexpr int kWarps = kColumnThreads / 32;

/// Adds each of the values (a power of two of them, at most 32) over the lanes of a warp, halving them on the way; lane l
/// gets the sum of value l / (32 / kCount). What was in the array is lost.
template <int kCount>
__device__ double warp_sums(double (&values)[kCount]) {
  const unsigned lane = threadIdx.x % 32;
  unsigned bit = 16;
#pragma unroll
  for (int half = kCount / 2; half > 0; half /= 2) {
    const bool upper = (lane & bit) != 0;
#pragma unroll
    for (int i = 0; i < half; ++i) {
      const double given = upper ? values[i] : values[i + half];
      const double kept = upper ? values[i + half] : values[i];
      values[i] = kept + __shfl_xor_sync(0xffffffffU, given, bit);
    }
    bit /= 2;
  }
  for (; bit > 0; bit /= 2) {
    values[0] += __shfl_xor_sync(0xffffffffU, values[0], bit);
  }
  return values[0];
}

/// The sum over a block of kColumnThreads, the same to the bit in all its threads, all of which must call.
__device__ inline double block_sum(double value) {
  __shared__ double of_warps[kWarps];
  double values[1] = {value};
  const double of_warp = warp_sums(values);
  if (threadIdx.x % 32 == 0) {
    of_warps[threadIdx.x / 32] = of_warp;
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

}  // namespace touchfield::cuda
