#include <algorithm>
#include <stdexcept>

#include "sim/gpu/cuda/launch.cuh"
#include "sim/gpu/cuda/sums.cuh"

namespace touchfield::cuda {

namespace {

constexpr int kThreads = 128;        // points a block
constexpr int kFillTile = 32;        // sources a block of fill_values
constexpr int kTile = 256;           // sources that are summed in single precision
constexpr int kStep = 4;             // of them side by side
constexpr int kWantedBlocks = 8192;  // of sum_values

template <bool kMiller, bool kTransposed>
constexpr Layer kLayerOf = kMiller ? (kTransposed ? Layer::kAdjointMiller : Layer::kBurtonMiller)
                                   : (kTransposed ? Layer::kAdjoint : Layer::kDouble);

template <bool kMiller, bool kDamped>
__global__ void __launch_bounds__(kThreads)
    fill_values(PairConstants<float> constants, FaceView faces, const cuDoubleComplex* diagonal, int first, int rows,
                const int* list, int columns, cuComplex* panel, int ld) {
  __shared__ Vector place[kFillTile];
  __shared__ float3 normal[kFillTile];
  __shared__ float weight[kFillTile];
  __shared__ int number[kFillTile];
  const int begin = static_cast<int>(blockIdx.y) * kFillTile;
  const int count = min(kFillTile, columns - begin);
  const int t = static_cast<int>(threadIdx.x);
  if (t < count) {
    const int j = list != nullptr ? list[begin + t] : begin + t;
    number[t] = j;
    place[t] = faces.place[j];
    normal[t] = faces.plain_normal[j];
    weight[t] = -faces.weight[j];
  }
  __syncthreads();
  const int row = static_cast<int>(blockIdx.x) * kThreads + t;
  if (row >= rows) {
    return;
  }
  const int i = first + row;
  const Vector x = faces.place[i];
  const float3 m = faces.plain_normal[i];
  cuComplex* out = panel + row + std::size_t{1} * begin * ld;
#pragma unroll 4
  for (int c = 0; c < count; ++c, out += ld) {
    float re;
    float im;
    pair_kernel<kLayerOf<kMiller, false>, kDamped>(constants, pair_distance<float>(x - place[c]), m, normal[c], re, im);
    *out = {weight[c] * re, weight[c] * im};
    if (number[c] == i) {
      *out = {static_cast<float>(diagonal[i].x), static_cast<float>(diagonal[i].y)};
    }
  }
}

/// Sums of the sources of one chunk at every point: partial(i, c, chunk). Transposed, a point's own weight is left out.
template <bool kMiller, bool kTransposed, bool kDamped, int kColumns>
__global__ void __launch_bounds__(kThreads) sum_values(PairConstants<float> constants, FaceView faces,
                                                       const cuComplex* x, int columns, int chunk, double2* partial) {
  __shared__ Vector place[kTile];
  __shared__ float3 normal[kTile];
  __shared__ float2 value[kTile * kColumns];
  const int t = static_cast<int>(threadIdx.x);
  const int row = static_cast<int>(blockIdx.x) * kThreads + t;
  const int i = min(row, faces.count - 1);  // all threads take part to the end
  const Vector at = faces.place[i];
  const float3 m = faces.plain_normal[i];
  const int begin = static_cast<int>(blockIdx.y) * chunk;
  const int end = min(begin + chunk, faces.count);
  double2 sum[kColumns] = {};
  for (int tile = begin; tile < end; tile += kTile) {
    const int count = min(kTile, end - tile);
    __syncthreads();
    const int padded = (count + kStep - 1) / kStep * kStep;  // by sources without a value
    for (int j = t; j < padded; j += kThreads) {
      const int source = min(tile + j, end - 1);
      place[j] = faces.place[source];
      normal[j] = faces.plain_normal[source];
      const float weight = j >= count ? 0.0F : (kTransposed ? 1.0F : faces.weight[source]);
      for (int c = 0; c < kColumns; ++c) {
        const cuComplex v = c < columns ? x[source + std::size_t{1} * c * faces.count] : cuComplex{0.0F, 0.0F};
        value[j * kColumns + c] = {weight * v.x, weight * v.y};
      }
    }
    __syncthreads();
    float2 part[kColumns] = {};
    for (int begin_step = 0; begin_step < padded; begin_step += kStep) {
#pragma unroll
      for (int step = 0; step < kStep; ++step) {
        const int j = begin_step + step;
        float re;
        float im;
        pair_kernel<kLayerOf<kMiller, kTransposed>, kDamped>(constants, pair_distance<float>(at - place[j]), m,
                                                             normal[j], re, im);
        for (int c = 0; c < kColumns; ++c) {
          const float2 v = value[j * kColumns + c];
          part[c].x += re * v.x - im * v.y;
          part[c].y += re * v.y + im * v.x;
        }
      }
    }
    for (int c = 0; c < kColumns; ++c) {
      sum[c].x += part[c].x;
      sum[c].y += part[c].y;
    }
  }
  if (row < faces.count) {
    double2* out = partial + std::size_t{1} * blockIdx.y * columns * faces.count + row;
#pragma unroll
    for (int c = 0; c < kColumns; ++c) {  // known indices keep the sums in registers
      if (c < columns) {
        out[std::size_t{1} * c * faces.count] = sum[c];
      }
    }
  }
}

/// y = diagonal x - the chunks' sums, in their order, times the weight of the point where they lack it; a thread for
/// each value of y.
__global__ void finish_sums(FaceView faces, bool transposed, const cuDoubleComplex* diagonal, const double2* partial,
                            int chunks, std::size_t size, const cuComplex* x, cuComplex* y) {
  const std::size_t at = std::size_t{1} * blockIdx.x * blockDim.x + threadIdx.x;
  if (at >= size) {
    return;
  }
  const std::size_t i = at % faces.count;
  double2 sum{0.0, 0.0};
  for (int chunk = 0; chunk < chunks; ++chunk) {
    const double2 part = partial[chunk * size + at];
    sum.x += part.x;
    sum.y += part.y;
  }
  const double scale = transposed ? static_cast<double>(faces.weight[i]) : 1.0;
  const cuDoubleComplex d = diagonal[i];
  const cuComplex v = x[at];
  y[at] = {static_cast<float>(d.x * v.x - d.y * v.y - scale * sum.x),
           static_cast<float>(d.x * v.y + d.y * v.x - scale * sum.y)};
}

/// sum_values for what is known when it runs.
template <int kColumns>
auto sum_kernel(bool miller, bool transposed, bool damped) {
  decltype(&sum_values<false, false, false, kColumns>)
      const kernels[2][2][2] = {{{sum_values<false, false, false, kColumns>, sum_values<false, false, true, kColumns>},
                                 {sum_values<false, true, false, kColumns>, sum_values<false, true, true, kColumns>}},
                                {{sum_values<true, false, false, kColumns>, sum_values<true, false, true, kColumns>},
                                 {sum_values<true, true, false, kColumns>, sum_values<true, true, true, kColumns>}}};
  return kernels[miller][transposed][damped];
}

}  // namespace

void fill_kernels(const Faces& faces, bool miller, const cuDoubleComplex* diagonal, int first, int rows,
                  const int* list, int columns, cuComplex* panel, int ld) {
  const PairConstants<float> constants = faces.wave().constants<float>();
  const bool damped = constants.damping != 0.0F;
  const auto kernel = miller ? (damped ? fill_values<true, true> : fill_values<true, false>)
                             : (damped ? fill_values<false, true> : fill_values<false, false>);
  launch(faces.context(), "kernels", kernel, dim3(blocks_for(rows, kThreads), blocks_for(columns, kFillTile)), kThreads,
         constants, faces.view(), diagonal, first, rows, list, columns, panel, ld);
}

void sum_kernels(const Faces& faces, bool miller, bool transposed, const cuDoubleComplex* diagonal, const cuComplex* x,
                 int columns, cuComplex* y, Array<double2>& partial) {
  if (columns < 1 || columns > kFewColumns) {
    throw std::invalid_argument("sum_kernels: more columns than it takes, or none");
  }
  const PairConstants<float> constants = faces.wave().constants<float>();
  const bool damped = constants.damping != 0.0F;
  const int row_blocks = static_cast<int>(blocks_for(faces.size(), kThreads));
  const int tiles = (faces.size() + kTile - 1) / kTile;
  const int wanted = std::clamp(kWantedBlocks / row_blocks, 1, tiles);
  const int chunk = (tiles + wanted - 1) / wanted * kTile;
  const int chunks = (faces.size() + chunk - 1) / chunk;
  const std::size_t size = std::size_t{1} * columns * faces.size();
  partial.resize(chunks * size);
  launch(faces.context(), "sums",
         columns == 1 ? sum_kernel<1>(miller, transposed, damped) : sum_kernel<kFewColumns>(miller, transposed, damped),
         dim3(row_blocks, chunks), kThreads, constants, faces.view(), x, columns, chunk, partial.data());
  launch(faces.context(), "sums", finish_sums, blocks_for(size, kThreads), kThreads, faces.view(), transposed, diagonal,
         partial.data(), chunks, size, x, y);
}

}  // namespace touchfield::cuda
