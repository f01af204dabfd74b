#include <cstdint>

#include "sim/bem/filter_formulas.h"
#include "sim/gpu/cuda/launch.cuh"
#include "sim/gpu/cuda/lists.cuh"
#include "sim/gpu/cuda/surface_filter.cuh"

namespace touchfield::cuda {

namespace {

constexpr int kThreads = 128;
constexpr int kCorners = 3;
constexpr int kVertexBits = 31;

/// Corner c of a face begins its edge c.
__device__ Vector corner(const FaceView& faces, int f, int c) {
  const int3 t = faces.triangle[f];
  return faces.vertex[c == 0 ? t.x : c == 1 ? t.y : t.z];
}

__global__ void number_edges(FaceView faces, std::int64_t* key, int* number) {
  const int f = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  if (f < faces.count) {
    const int3 t = faces.triangle[f];
    const int ends[kCorners + 1] = {t.x, t.y, t.z, t.x};
    for (int c = 0; c < kCorners; ++c) {
      const std::int64_t low = min(ends[c], ends[c + 1]);
      key[kCorners * f + c] = (low << kVertexBits) + max(ends[c], ends[c + 1]);
      number[kCorners * f + c] = kCorners * f + c;
    }
  }
}

/// Nothing flows where a surface ends or branches.
__global__ void pair_edges(int count, const std::int64_t* key, const int* number, int* neighbour) {
  const int p = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  const auto is = [&](int q) { return q >= 0 && q < count && key[q] == key[p]; };
  if (p < count && is(p + 1) && !is(p - 1) && !is(p + 2)) {
    neighbour[number[p]] = number[p + 1];
    neighbour[number[p + 1]] = number[p];
  }
}

__device__ double height(const FaceView& faces, int edge) {
  const int f = edge / kCorners;
  const Vector from = corner(faces, f, edge % kCorners);
  const Vector along = corner(faces, f, (edge % kCorners + 1) % kCorners) - from;
  return norm(cross(faces.centroid[f] - from, along)) / norm(along);
}

__global__ void make_laplacian(FaceView faces, const int* neighbour, float* weight, double* diagonal) {
  const int f = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  if (f >= faces.count) {
    return;
  }
  double sum = 0.0;
  for (int c = 0; c < kCorners; ++c) {
    const int edge = kCorners * f + c;
    double flow = 0.0;
    if (neighbour[edge] >= 0) {
      const double length = norm(corner(faces, f, (c + 1) % kCorners) - corner(faces, f, c));
      flow = length / (height(faces, edge) + height(faces, neighbour[edge])) / faces.area[f];
    }
    weight[edge] = static_cast<float>(-flow);
    sum += flow;
  }
  diagonal[f] = sum;
}

/// To [-1, 1], eigenvalues from 0 to `largest`.
__global__ void scale_laplacian(int count, double largest, const double* diagonal, float* weight, float* own) {
  const int f = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  if (f < count) {
    own[f] = static_cast<float>(2.0 * diagonal[f] / largest - 1.0);
    for (int c = 0; c < kCorners; ++c) {
      weight[kCorners * f + c] *= static_cast<float>(2.0 / largest);
    }
  }
}

/// A row of the scaled Laplacian times what `value` has of each face.
template <typename Value>
__device__ cuComplex row_product(int f, const int* neighbour, const float* weight, const float* own,
                                 const Value& value) {
  cuComplex sum = scaled(value(f), own[f]);
  for (int c = 0; c < kCorners; ++c) {
    const int other = neighbour[kCorners * f + c];
    if (other >= 0) {
      sum = cuCaddf(sum, scaled(value(other / kCorners), weight[kCorners * f + c]));
    }
  }
  return sum;
}

/// The first two terms; x over the areas where they are given. Columns along y, here and below.
__global__ void begin_polynomial(int count, const int* neighbour, const float* weight, const float* own,
                                 const double* area, cuComplex c0, cuComplex c1, const cuComplex* x, cuComplex* before,
                                 cuComplex* now, cuComplex* y) {
  const int f = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  if (f >= count) {
    return;
  }
  const std::size_t column = std::size_t{blockIdx.y} * count;
  const auto value = [&](int i) { return area != nullptr ? scaled(x[column + i], 1.0 / area[i]) : x[column + i]; };
  const cuComplex first = value(f);
  const cuComplex second = row_product(f, neighbour, weight, own, value);
  before[column + f] = first;
  now[column + f] = second;
  y[column + f] = cuCaddf(cuCmulf(c0, first), cuCmulf(c1, second));
}

/// The next term, which replaces `before`; with areas y is multiplied by them.
__global__ void continue_polynomial(int count, const int* neighbour, const float* weight, const float* own,
                                    const double* area, cuComplex c, const cuComplex* now, cuComplex* before,
                                    cuComplex* y) {
  const int f = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  if (f >= count) {
    return;
  }
  const std::size_t column = std::size_t{blockIdx.y} * count;
  const cuComplex product = row_product(f, neighbour, weight, own, [&](int i) { return now[column + i]; });
  const cuComplex next = cuCsubf(scaled(product, 2.0), before[column + f]);
  before[column + f] = next;
  const cuComplex sum = cuCaddf(y[column + f], cuCmulf(c, next));
  y[column + f] = area != nullptr ? scaled(sum, area[f]) : sum;
}

}  // namespace

SurfaceFilter::SurfaceFilter(const Faces& faces, double coupling) : faces_(faces), context_(faces.context()) {
  find_neighbours();
  const auto count = static_cast<std::size_t>(faces.size());
  const unsigned blocks = blocks_for(count, kThreads);
  weight_.resize(kCorners * count);
  own_.resize(count);
  Array<double> diagonal(context_, count);
  launch(context_, "Laplacian", make_laplacian, blocks, kThreads, faces.view(), neighbour_.data(), weight_.data(),
         diagonal.data());
  int at = 0;
  check(cublasIdamax(context_.blas(), faces.size(), diagonal.data(), 1, &at), "Laplacian");
  const double largest = 2.0 * diagonal.value(static_cast<std::size_t>(at - 1));
  launch(context_, "Laplacian", scale_laplacian, blocks, kThreads, faces.size(), largest, diagonal.data(),
         weight_.data(), own_.data());
  const SurfaceWave& wave = faces.wave();
  for (const std::complex<double>& c : filter_coefficients({wave.k, wave.alpha}, coupling, largest)) {
    coefficients_.push_back({static_cast<float>(c.real()), static_cast<float>(c.imag())});
  }
}

void SurfaceFilter::find_neighbours() {
  const std::size_t count = std::size_t{kCorners} * faces_.size();
  Array<std::int64_t> key(context_, count), sorted(context_);
  Array<int> number(context_, count), moved(context_);
  launch(context_, "edges", number_edges, blocks_for(faces_.size(), kThreads), kThreads, faces_.view(), key.data(),
         number.data());
  sort_pairs(context_, std::int64_t{1} << (2 * kVertexBits - 1), key, number, sorted, moved);
  neighbour_.resize(count);
  check(cudaMemsetAsync(neighbour_.data(), 0xff, count * sizeof(int), context_.stream()), "edges");
  launch(context_, "edges", pair_edges, blocks_for(count, kThreads), kThreads, static_cast<int>(count), sorted.data(),
         moved.data(), neighbour_.data());
}

void SurfaceFilter::apply(bool transposed, const cuComplex* x, int columns, cuComplex* y) {
  const int count = faces_.size();
  before_.resize(std::size_t{1} * count * columns);
  now_.resize(before_.size());
  const dim3 blocks(blocks_for(count, kThreads), columns);
  const double* area = transposed ? faces_.view().area : nullptr;
  launch(context_, "filter", begin_polynomial, blocks, kThreads, count, neighbour_.data(), weight_.data(), own_.data(),
         area, coefficients_[0], coefficients_[1], x, before_.data(), now_.data(), y);
  for (int j = 2; j <= degree(); ++j) {
    launch(context_, "filter", continue_polynomial, blocks, kThreads, count, neighbour_.data(), weight_.data(),
           own_.data(), j == degree() ? area : nullptr, coefficients_[static_cast<std::size_t>(j)], now_.data(),
           before_.data(), y);
    before_.swap(now_);
  }
}

}  // namespace touchfield::cuda
