#pragma once

// For .cu files only: launches, and sums over lanes.
#include <type_traits>

#include "sim/gpu/cuda/context.cuh"

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

/// The sum over each kLanes lanes of a warp, the same in all of them.
template <int kLanes>
__device__ double lane_sum(double value) {
#pragma unroll
  for (int apart = 1; apart < kLanes; apart *= 2) {
    value += __shfl_xor_sync(kAllLanes, value, apart);
  }
  return value;
}

}  // namespace touchfield::cuda
