#include <algorithm>
#include <stdexcept>
#include <type_traits>

#include "sim/gpu/cuda/sums.cuh"

namespace touchfield::cuda {

namespace {

constexpr int kThreads = 128;        // points a block
constexpr int kFillTile = 32;        // sources a block of fill_values
constexpr int kTile = 256;           // sources that are summed in single precision
constexpr int kStep = 4;             // of them side by side
constexpr int kWantedBlocks = 8192;  // of sum_values
constexpr int kPointPanel = 4096;    // points of layer_at_points that meet many columns at once

template <Layer kLayer, bool kDamped, typename Place>
__global__ void __launch_bounds__(kThreads)
    fill_values(PairConstants<float> constants, PairView<Place> points, int first, int rows, PairView<Place> sources,
                const int* list, int columns, float factor, cuComplex* panel, int ld) {
  __shared__ Place place[kFillTile];
  __shared__ float3 normal[kFillTile];
  __shared__ float weight[kFillTile];
  const int begin = static_cast<int>(blockIdx.y) * kFillTile;
  const int count = min(kFillTile, columns - begin);
  const int t = static_cast<int>(threadIdx.x);
  if (t < count) {
    const int j = list != nullptr ? list[begin + t] : begin + t;
    place[t] = sources.place[j];
    normal[t] = sources.normal[j];
    weight[t] = factor * sources.weight[j];
  }
  __syncthreads();
  const int row = static_cast<int>(blockIdx.x) * kThreads + t;
  if (row >= rows) {
    return;
  }
  const int i = first + row;
  const Place x = points.place[i];
  const float3 m = points.normal != nullptr ? points.normal[i] : float3{0.0F, 0.0F, 0.0F};
  cuComplex* out = panel + row + static_cast<std::size_t>(begin) * static_cast<std::size_t>(ld);
#pragma unroll 4
  for (int c = 0; c < count; ++c, out += ld) {
    float re;
    float im;
    const float3 n = normal[c];
    pair_kernel<kLayer, kDamped>(constants, distance_between(x, place[c]), m.x, m.y, m.z, n.x, n.y, n.z, re, im);
    *out = {weight[c] * re, weight[c] * im};
  }
}

__global__ void set_diagonal(const cuDoubleComplex* diagonal, int first, int rows, const int* list, int columns,
                             cuComplex* panel, int ld) {
  const int c = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  if (c >= columns) {
    return;
  }
  const int j = list != nullptr ? list[c] : c;
  if (j >= first && j < first + rows) {
    const cuDoubleComplex d = diagonal[j];
    panel[j - first + static_cast<std::size_t>(c) * static_cast<std::size_t>(ld)] = {static_cast<float>(d.x),
                                                                                     static_cast<float>(d.y)};
  }
}

/// Sums of the sources of one chunk at every point: partial(i, c, chunk).
template <Layer kLayer, bool kDamped, typename Place, int kColumns>
__global__ void __launch_bounds__(kThreads)
    sum_values(PairConstants<float> constants, PairView<Place> points, PairView<Place> sources, const cuComplex* x,
               int columns, int chunk, double2* partial) {
  __shared__ Place place[kTile];
  __shared__ float3 normal[kTile];
  __shared__ float2 value[kTile * kColumns];
  const int t = static_cast<int>(threadIdx.x);
  const int row = static_cast<int>(blockIdx.x) * kThreads + t;
  const int i = min(row, points.count - 1);  // all threads take part to the end
  const Place at = points.place[i];
  const float3 m = points.normal != nullptr ? points.normal[i] : float3{0.0F, 0.0F, 0.0F};
  const int begin = static_cast<int>(blockIdx.y) * chunk;
  const int end = min(begin + chunk, sources.count);
  double2 sum[kColumns] = {};
  for (int tile = begin; tile < end; tile += kTile) {
    const int count = min(kTile, end - tile);
    __syncthreads();
    const int padded = (count + kStep - 1) / kStep * kStep;  // by sources without a value
    for (int j = t; j < padded; j += kThreads) {
      const int source = min(tile + j, end - 1);
      place[j] = sources.place[source];
      normal[j] = sources.normal[source];
      const float weight = j >= count ? 0.0F : (sources.weight != nullptr ? sources.weight[source] : 1.0F);
      for (int c = 0; c < kColumns; ++c) {
        const cuComplex v =
            c < columns ? x[source + static_cast<std::size_t>(c) * sources.count] : cuComplex{0.0F, 0.0F};
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
        const float3 n = normal[j];
        pair_kernel<kLayer, kDamped>(constants, distance_between(at, place[j]), m.x, m.y, m.z, n.x, n.y, n.z, re, im);
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
  if (row < points.count) {
    double2* out = partial + static_cast<std::size_t>(blockIdx.y) * static_cast<std::size_t>(columns) *
                                 static_cast<std::size_t>(points.count);
#pragma unroll
    for (int c = 0; c < kColumns; ++c) {  // known indices keep the sums in registers
      if (c < columns) {
        out[static_cast<std::size_t>(c) * static_cast<std::size_t>(points.count) + static_cast<std::size_t>(row)] =
            sum[c];
      }
    }
  }
}

/// y = diagonal x + factor weight times the chunks' sums, in their order.
__global__ void finish_sums(const double2* partial, int chunks, int count, int columns, float factor,
                            const float* weight, const cuDoubleComplex* diagonal, const cuComplex* x, cuComplex* y) {
  const int i = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  if (i >= count) {
    return;
  }
  const double scale = static_cast<double>(factor) * (weight != nullptr ? static_cast<double>(weight[i]) : 1.0);
  for (int c = 0; c < columns; ++c) {
    double re = 0.0;
    double im = 0.0;
    for (int chunk = 0; chunk < chunks; ++chunk) {
      const double2 part =
          partial[(static_cast<std::size_t>(chunk) * static_cast<std::size_t>(columns) + static_cast<std::size_t>(c)) *
                      static_cast<std::size_t>(count) +
                  static_cast<std::size_t>(i)];
      re += part.x;
      im += part.y;
    }
    re *= scale;
    im *= scale;
    const std::size_t at = static_cast<std::size_t>(c) * static_cast<std::size_t>(count) + static_cast<std::size_t>(i);
    if (diagonal != nullptr) {
      const cuDoubleComplex d = diagonal[i];
      const cuComplex v = x[at];
      re += d.x * v.x - d.y * v.y;
      im += d.x * v.y + d.y * v.x;
    }
    y[at] = {static_cast<float>(re), static_cast<float>(im)};
  }
}

/// Places in half wavelengths from the centre.
template <typename Place>
__global__ void make_places(const Vector* points, int count, Vector centre, double scale, Place* places) {
  const int j = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  if (j < count) {
    const Vector p = scale * (points[j] - centre);
    if constexpr (std::is_same_v<Place, Vector>) {
      places[j] = p;
    } else {
      places[j] = {static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z)};
    }
  }
}

struct FillCall {
  float factor;
  int first, rows;
  const int* list;
  int columns;
  const cuDoubleComplex* diagonal;
  cuComplex* panel;
  int ld;
};

template <Layer kLayer, typename Place>
void fill(const Faces& faces, const PairView<Place>& points, const FillCall& call) {
  if (call.rows == 0 || call.columns == 0) {
    return;
  }
  const PairView<Place> sources = faces.pairs<Place>();
  const PairConstants<float> constants = faces.wave().constants<float>();
  const dim3 blocks(blocks_for(static_cast<std::size_t>(call.rows), kThreads),
                    blocks_for(static_cast<std::size_t>(call.columns), kFillTile));
  const auto kernel = constants.damping != 0.0F ? fill_values<kLayer, true, Place> : fill_values<kLayer, false, Place>;
  kernel<<<blocks, kThreads, 0, faces.context().stream()>>>(constants, points, call.first, call.rows, sources,
                                                            call.list, call.columns, call.factor, call.panel, call.ld);
  faces.context().launched("kernels");
  if (call.diagonal != nullptr) {
    set_diagonal<<<blocks_for(static_cast<std::size_t>(call.columns), kThreads), kThreads, 0,
                   faces.context().stream()>>>(call.diagonal, call.first, call.rows, call.list, call.columns,
                                               call.panel, call.ld);
    faces.context().launched("kernels");
  }
}

template <typename Place>
void fill_layer(const Faces& faces, Layer layer, const FillCall& call) {
  const PairView<Place> points = faces.pairs<Place>();
  if (layer == Layer::kDouble) {
    fill<Layer::kDouble>(faces, points, call);
  } else if (layer == Layer::kBurtonMiller) {
    fill<Layer::kBurtonMiller>(faces, points, call);
  } else {
    throw std::invalid_argument("fill_kernels: this layer is not made");
  }
}

struct SumCall {
  float factor;
  const float* weight;  // of the points
  const cuDoubleComplex* diagonal;
  const cuComplex* x;
  int columns;
  cuComplex* y;
};

template <Layer kLayer, typename Place>
void sum(const Faces& faces, const PairView<Place>& points, const PairView<Place>& sources, const SumCall& call,
         Array<double2>& partial) {
  Context& context = faces.context();
  const PairConstants<float> constants = faces.wave().constants<float>();
  const auto rows = static_cast<std::size_t>(points.count);
  const unsigned row_blocks = blocks_for(rows, kThreads);
  const int tiles = (sources.count + kTile - 1) / kTile;
  const int wanted = std::clamp(kWantedBlocks / static_cast<int>(row_blocks), 1, tiles);
  const int chunk = (tiles + wanted - 1) / wanted * kTile;
  const int chunks = (sources.count + chunk - 1) / chunk;
  partial.resize(static_cast<std::size_t>(chunks) * static_cast<std::size_t>(call.columns) * rows);
  const bool damped = constants.damping != 0.0F;
  const auto one = damped ? sum_values<kLayer, true, Place, 1> : sum_values<kLayer, false, Place, 1>;
  const auto few =
      damped ? sum_values<kLayer, true, Place, kFewColumns> : sum_values<kLayer, false, Place, kFewColumns>;
  const auto kernel = call.columns == 1 ? one : few;
  kernel<<<dim3(row_blocks, static_cast<unsigned>(chunks)), kThreads, 0, context.stream()>>>(
      constants, points, sources, call.x, call.columns, chunk, partial.data());
  context.launched("sums");
  finish_sums<<<row_blocks, kThreads, 0, context.stream()>>>(partial.data(), chunks, points.count, call.columns,
                                                             call.factor, call.weight, call.diagonal, call.x, call.y);
  context.launched("sums");
}

template <typename Place>
void sum_layer(const Faces& faces, Layer layer, bool transposed, SumCall call, Array<double2>& partial) {
  const PairView<Place> points = faces.pairs<Place>();
  PairView<Place> sources = points;
  if (transposed) {  // the weights are of the points then
    call.weight = sources.weight;
    sources.weight = nullptr;
  }
  if (layer == Layer::kDouble) {
    transposed ? sum<Layer::kAdjoint>(faces, points, sources, call, partial)
               : sum<Layer::kDouble>(faces, points, sources, call, partial);
  } else if (layer == Layer::kBurtonMiller) {
    transposed ? sum<Layer::kAdjointMiller>(faces, points, sources, call, partial)
               : sum<Layer::kBurtonMiller>(faces, points, sources, call, partial);
  } else {
    throw std::invalid_argument("sum_kernels: this layer is not made");
  }
}

template <typename Place>
void layer_at(const Faces& faces, const Vector* points, int count, const cuComplex* pressures, int columns,
              cuComplex* values) {
  Context& context = faces.context();
  Array<Place> places(context, static_cast<std::size_t>(count));
  make_places<<<blocks_for(places.size(), kThreads), kThreads, 0, context.stream()>>>(
      points, count, faces.centre(), faces.wave().scale(), places.data());
  context.launched("places");
  const PairView<Place> view{places.data(), nullptr, nullptr, count};
  if (columns <= kFewColumns) {
    Array<double2> partial(context);
    sum<Layer::kDouble>(faces, view, faces.pairs<Place>(), {1.0F, nullptr, nullptr, pressures, columns, values},
                        partial);
    return;
  }
  const int rows = std::min(kPointPanel, count);
  Array<cuComplex> panel(context, static_cast<std::size_t>(rows) * static_cast<std::size_t>(faces.size()));
  for (int first = 0; first < count; first += rows) {
    const int taken = std::min(rows, count - first);
    fill<Layer::kDouble>(faces, view, {1.0F, first, taken, nullptr, faces.size(), nullptr, panel.data(), rows});
    multiply(context, CUBLAS_OP_N, CUBLAS_OP_N, taken, columns, faces.size(), {1.0F, 0.0F}, panel.data(), rows,
             pressures, faces.size(), {0.0F, 0.0F}, values + first, count, Arithmetic::kSingle);
  }
}

}  // namespace

void fill_kernels(const Faces& faces, Layer layer, Differences differences, float factor, int first, int rows,
                  const int* columns, int count, const cuDoubleComplex* diagonal, cuComplex* panel, int ld) {
  const FillCall call{factor, first, rows, columns, count, diagonal, panel, ld};
  differences == Differences::kDouble ? fill_layer<Vector>(faces, layer, call) : fill_layer<float3>(faces, layer, call);
}

void sum_kernels(const Faces& faces, Layer layer, Differences differences, bool transposed, float factor,
                 const cuDoubleComplex* diagonal, const cuComplex* x, int columns, cuComplex* y,
                 Array<double2>& partial) {
  if (columns < 1 || columns > kFewColumns) {
    throw std::invalid_argument("sum_kernels: more columns than it takes, or none");
  }
  const SumCall call{factor, nullptr, diagonal, x, columns, y};
  differences == Differences::kDouble ? sum_layer<Vector>(faces, layer, transposed, call, partial)
                                      : sum_layer<float3>(faces, layer, transposed, call, partial);
}

void layer_at_points(const Faces& faces, Differences differences, const double* points, int count,
                     const cuComplex* pressures, int columns, cuComplex* values) {
  if (count == 0 || columns == 0) {
    return;
  }
  const auto* places = reinterpret_cast<const Vector*>(points);
  differences == Differences::kDouble ? layer_at<Vector>(faces, places, count, pressures, columns, values)
                                      : layer_at<float3>(faces, places, count, pressures, columns, values);
}

}  // namespace touchfield::cuda
