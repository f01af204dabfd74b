#include "sim/gpu/cuda/near.cuh"

namespace touchfield::cuda {

namespace {

constexpr unsigned kThreads = 128;
constexpr unsigned kWarp = 32;
constexpr unsigned kAll = 0xffffffffU;

/// A warp a row and column of x. pair: null, or the number of each value.
__global__ void add_sparse(int size, const int* start, const int* index, const int* pair, const cuComplex* value,
                           float factor, const cuComplex* x, cuComplex* y) {
  const int lane = static_cast<int>(threadIdx.x % kWarp);
  const int i = static_cast<int>((blockIdx.x * blockDim.x + threadIdx.x) / kWarp);
  if (i >= size) {
    return;
  }
  const std::size_t column = static_cast<std::size_t>(blockIdx.y) * static_cast<std::size_t>(size);
  double re = 0.0;
  double im = 0.0;
  for (int q = start[i] + lane; q < start[i + 1]; q += static_cast<int>(kWarp)) {
    const cuComplex n = value[pair != nullptr ? pair[q] : q];
    const cuComplex v = x[column + static_cast<std::size_t>(index[q])];
    re += static_cast<double>(n.x) * v.x - static_cast<double>(n.y) * v.y;
    im += static_cast<double>(n.x) * v.y + static_cast<double>(n.y) * v.x;
  }
  for (unsigned apart = kWarp / 2; apart > 0; apart /= 2) {
    re += __shfl_xor_sync(kAll, re, static_cast<int>(apart));
    im += __shfl_xor_sync(kAll, im, static_cast<int>(apart));
  }
  if (lane == 0) {
    cuComplex& out = y[column + static_cast<std::size_t>(i)];
    out = {static_cast<float>(out.x + factor * re), static_cast<float>(out.y + factor * im)};
  }
}

/// A warp a row.
__global__ void add_rows(int first, int rows, const int* start, const int* column, const cuComplex* value, float factor,
                         cuComplex* panel, int ld) {
  const int lane = static_cast<int>(threadIdx.x % kWarp);
  const int row = static_cast<int>((blockIdx.x * blockDim.x + threadIdx.x) / kWarp);
  if (row >= rows) {
    return;
  }
  for (int q = start[first + row] + lane; q < start[first + row + 1]; q += static_cast<int>(kWarp)) {
    cuComplex& out = panel[row + static_cast<std::size_t>(column[q]) * static_cast<std::size_t>(ld)];
    out = {out.x + factor * value[q].x, out.y + factor * value[q].y};
  }
}

/// A warp a column.
__global__ void add_columns(const int* faces, int count, const int* start, const int* row, const int* pair,
                            const cuComplex* value, float factor, cuComplex* out, int ld) {
  const int lane = static_cast<int>(threadIdx.x % kWarp);
  const int c = static_cast<int>((blockIdx.x * blockDim.x + threadIdx.x) / kWarp);
  if (c >= count) {
    return;
  }
  const int j = faces[c];
  for (int q = start[j] + lane; q < start[j + 1]; q += static_cast<int>(kWarp)) {
    cuComplex& at = out[row[q] + static_cast<std::size_t>(c) * static_cast<std::size_t>(ld)];
    const cuComplex n = value[pair[q]];
    at = {at.x + factor * n.x, at.y + factor * n.y};
  }
}

/// Blocks that hold a warp for each of `count`.
unsigned warp_blocks(int count) { return blocks_for(static_cast<std::size_t>(count) * kWarp, kThreads); }

}  // namespace

void NearCorrections::add_product(float factor, const cuComplex* x, cuComplex* y, int columns) const {
  Context& context = faces_.context();
  const dim3 blocks(warp_blocks(faces_.size()), static_cast<unsigned>(columns));
  add_sparse<<<blocks, kThreads, 0, context.stream()>>>(faces_.size(), start_.data(), column_.data(), nullptr,
                                                        value_.data(), factor, x, y);
  context.launched("near product");
}

void NearCorrections::add_transposed_product(float factor, const cuComplex* x, cuComplex* y, int columns) {
  make_transposed();
  Context& context = faces_.context();
  const dim3 blocks(warp_blocks(faces_.size()), static_cast<unsigned>(columns));
  add_sparse<<<blocks, kThreads, 0, context.stream()>>>(faces_.size(), transposed_start_.data(), transposed_row_.data(),
                                                        transposed_pair_.data(), value_.data(), factor, x, y);
  context.launched("near product");
}

void NearCorrections::add_to_rows(float factor, int first, int rows, cuComplex* panel, int ld) const {
  if (rows > 0) {
    Context& context = faces_.context();
    add_rows<<<warp_blocks(rows), kThreads, 0, context.stream()>>>(first, rows, start_.data(), column_.data(),
                                                                   value_.data(), factor, panel, ld);
    context.launched("near rows");
  }
}

void NearCorrections::add_to_columns(float factor, const int* faces, int count, cuComplex* out, int ld) {
  if (count > 0) {
    make_transposed();
    Context& context = faces_.context();
    add_columns<<<warp_blocks(count), kThreads, 0, context.stream()>>>(faces, count, transposed_start_.data(),
                                                                       transposed_row_.data(), transposed_pair_.data(),
                                                                       value_.data(), factor, out, ld);
    context.launched("near columns");
  }
}

}  // namespace touchfield::cuda
