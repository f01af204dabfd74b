#pragma once

#include "sim/gpu/cuda/context.cuh"

namespace touchfield::cuda {

/// Products of a matrix with a few vectors, and sums over warps and blocks: always in the same order. Numbers are
/// complex, float2 or double2.

constexpr int kWarp = 32;
constexpr unsigned kBlock = 256;  // threads where nothing speaks for another number
constexpr int kShare = 128;       // columns that a block of multiply_share sums

/// sum += a b
__device__ inline void add_product(float2& sum, float2 a, float2 b) {
  sum.x += a.x * b.x - a.y * b.y;
  sum.y += a.x * b.y + a.y * b.x;
}
__device__ inline void add_product(double2& sum, double2 a, double2 b) {
  sum.x += a.x * b.x - a.y * b.y;
  sum.y += a.x * b.y + a.y * b.x;
}

/// sum += conj(a) b
__device__ inline void add_adjoint_product(float2& sum, float2 a, float2 b) {
  sum.x += a.x * b.x + a.y * b.y;
  sum.y += a.x * b.y - a.y * b.x;
}
__device__ inline void add_adjoint_product(double2& sum, double2 a, double2 b) {
  sum.x += a.x * b.x + a.y * b.y;
  sum.y += a.x * b.y - a.y * b.x;
}
__device__ inline void add_adjoint_product(double2& sum, float2 a, double2 b) {
  add_adjoint_product(sum, double2{a.x, a.y}, b);
}

__device__ inline void add(double& sum, double a) { sum += a; }
__device__ inline void add(float2& sum, float2 a) {
  sum.x += a.x;
  sum.y += a.y;
}
__device__ inline void add(double2& sum, double2 a) {
  sum.x += a.x;
  sum.y += a.y;
}

template <typename Real>
__device__ Real from_lane_below(Real a, int offset) {
  return __shfl_down_sync(0xffffffffU, a, static_cast<unsigned>(offset));
}
__device__ inline float2 from_lane_below(float2 a, int offset) {
  return {from_lane_below(a.x, offset), from_lane_below(a.y, offset)};
}
__device__ inline double2 from_lane_below(double2 a, int offset) {
  return {from_lane_below(a.x, offset), from_lane_below(a.y, offset)};
}

/// The sum over a warp, all of whose lanes call, in its first lane.
template <typename Value>
__device__ Value warp_sum(Value value) {
  for (int offset = kWarp / 2; offset > 0; offset /= 2) {
    add(value, from_lane_below(value, offset));
  }
  return value;
}

/// The sum over a block of whole warps in one dimension, all of whose threads call, in its first thread.
__device__ inline double block_sum(double value) {
  __shared__ double sums[kWarp];
  const unsigned lane = threadIdx.x % kWarp;
  const unsigned warp = threadIdx.x / kWarp;
  value = warp_sum(value);
  if (lane == 0) {
    sums[warp] = value;
  }
  __syncthreads();
  if (warp == 0) {
    value = warp_sum(lane < blockDim.x / kWarp ? sums[lane] : 0.0);
  }
  __syncthreads();  // the sums may be written again
  return value;
}

/// back_z(n) = sum over `rows` rows of conj(a(i, n)) v_z(i), z = blockIdx.y: a warp a column.
template <typename Entry, typename Value>
__global__ void multiply_adjoint(const Entry* a, int ld, int rows, int columns, const Value* v, Value* back) {
  const int column = static_cast<int>(blockIdx.x * (blockDim.x / kWarp) + threadIdx.x / kWarp);
  const int lane = static_cast<int>(threadIdx.x % kWarp);
  if (column >= columns) {
    return;  // the whole warp
  }
  const Entry* entries = a + std::size_t{1} * column * ld;
  const Value* values = v + std::size_t{1} * blockIdx.y * rows;
  Value sum{};
  for (int i = lane; i < rows; i += kWarp) {
    add_adjoint_product(sum, entries[i], values[i]);
  }
  sum = warp_sum(sum);
  if (lane == 0) {
    back[std::size_t{1} * blockIdx.y * columns + column] = sum;
  }
}

/// parts(row, share, z) = sum over the share's kShare columns of a(row, n) x_z(n), z = blockIdx.z; blocks of 32 rows x 8.
template <typename Value>
__global__ void multiply_share(const Value* a, int ld, int rows, int columns, const Value* x, Value* parts) {
  __shared__ Value sums[8][kWarp];
  const int row = static_cast<int>(blockIdx.x) * kWarp + static_cast<int>(threadIdx.x);
  const int begin = static_cast<int>(blockIdx.y) * kShare;
  const int end = begin + kShare < columns ? begin + kShare : columns;
  const Value* values = x + std::size_t{1} * blockIdx.z * columns;
  Value sum{};
  if (row < rows) {
    for (int n = begin + static_cast<int>(threadIdx.y); n < end; n += 8) {
      add_product(sum, a[row + std::size_t{1} * n * ld], values[n]);
    }
  }
  sums[threadIdx.y][threadIdx.x] = sum;
  __syncthreads();
  if (threadIdx.y == 0 && row < rows) {
    for (int i = 1; i < 8; ++i) {
      add(sum, sums[i][threadIdx.x]);
    }
    parts[(std::size_t{1} * blockIdx.z * gridDim.y + blockIdx.y) * rows + row] = sum;
  }
}

/// One row's sum over the shares of a vector.
template <typename Value>
__device__ Value sum_shares(const Value* parts, int rows, int shares, int row) {
  Value sum{};
  for (int i = 0; i < shares; ++i) {
    add(sum, parts[std::size_t{1} * i * rows + row]);
  }
  return sum;
}

/// sent(row, z) from the parts, z = blockIdx.y.
template <typename Value>
__global__ void add_shares(const Value* parts, int rows, int shares, Value* sent) {
  const int row = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  if (row < rows) {
    sent[std::size_t{1} * blockIdx.y * rows + row] =
        sum_shares(parts + std::size_t{1} * blockIdx.y * shares * rows, rows, shares, row);
  }
}

inline int shares_of(int columns) { return (columns + kShare - 1) / kShare; }

/// Launches multiply_adjoint for `width` vectors one after another; rows may be 0.
template <typename Entry, typename Value>
void launch_adjoint(Context& context, const Entry* a, int ld, int rows, int columns, int width, const Value* v,
                    Value* back) {
  const dim3 blocks(blocks_for(static_cast<std::size_t>(columns), kBlock / kWarp), static_cast<unsigned>(width));
  multiply_adjoint<<<blocks, kBlock, 0, context.stream()>>>(a, ld, rows, columns, v, back);
  context.launched("product");
}

/// Launches multiply_share for all columns; parts gets rows x shares_of(columns) x width entries.
template <typename Value>
void launch_shares(Context& context, const Value* a, int ld, int rows, int columns, int width, const Value* x,
                   Array<Value>& parts) {
  const int shares = shares_of(columns);
  parts.resize(std::size_t{1} * rows * shares * width);
  const dim3 blocks(blocks_for(static_cast<std::size_t>(rows), kWarp), static_cast<unsigned>(shares),
                    static_cast<unsigned>(width));
  multiply_share<<<blocks, dim3(kWarp, 8), 0, context.stream()>>>(a, ld, rows, columns, x, parts.data());
  context.launched("product");
}

/// sent = a x for `width` vectors.
template <typename Value>
void launch_product(Context& context, const Value* a, int ld, int rows, int columns, int width, const Value* x,
                    Array<Value>& parts, Value* sent) {
  launch_shares(context, a, ld, rows, columns, width, x, parts);
  const dim3 blocks(blocks_for(static_cast<std::size_t>(rows), kBlock), static_cast<unsigned>(width));
  add_shares<<<blocks, kBlock, 0, context.stream()>>>(parts.data(), rows, shares_of(columns), sent);
  context.launched("product");
}

}  // namespace touchfield::cuda
