#pragma once

#include <type_traits>

#include "sim/gpu/cuda/context.cuh"

// For .cu files only: launches, sums over lanes, and kernels that give a column to a block of threads.

namespace touchfield::cuda {

constexpr int kWarp = 32;
constexpr unsigned kAllLanes = 0xffffffffU;

/// A kernel on the context's stream; none where there are no blocks.
template <typename... Parameters>
void launch(Context& context, const char* what, void (*kernel)(Parameters...), dim3 blocks, dim3 threads,
            std::common_type_t<Parameters>... arguments) {
  if (blocks.x > 0 && blocks.y > 0) {
    kernel<<<blocks, threads, 0, context.stream()>>>(arguments...);
    context.launched(what);
  }
}

/// Carries out a function of CUB's, which says first how much room it needs.
template <typename Function>
void with_room(Context& context, const char* what, const Function& function) {
  std::size_t bytes = 0;
  check(function(nullptr, bytes), what);
  Array<char> room(context, bytes);
  check(function(room.data(), bytes), what);
}

/// The sum over each kLanes lanes of a warp, the same in all of them.
template <int kLanes>
__device__ double lane_sum(double value) {
#pragma unroll
  for (int apart = 1; apart < kLanes; apart *= 2) {
    value += __shfl_xor_sync(kAllLanes, value, apart);
  }
  return value;
}

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
