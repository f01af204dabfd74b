#include <algorithm>
#include <stdexcept>

#include "sim/gpu/cuda/boundary.cuh"
#include "sim/gpu/cuda/launch.cuh"

namespace touchfield::cuda {

namespace {

constexpr int kThreads = 128;        // threads of a block
constexpr int kFillTile = 32;        // sources a block of fill_values
constexpr int kTile = 256;           // sources that are summed in single precision
constexpr int kStep = 4;             // of them side by side
constexpr int kWantedBlocks = 8192;  // of sum_values

template <bool kMiller, bool kTransposed>
constexpr Layer kLayerOf = kMiller ? (kTransposed ? Layer::kAdjointMiller : Layer::kBurtonMiller)
                                   : (kTransposed ? Layer::kAdjoint : Layer::kDouble);

template <bool kMiller, bool kDamped>
__global__ void __launch_bounds__(kThreads)
    fill_values(PairConstants<float> constants, FaceView faces, const cuDoubleComplex* diagonal, RowRange range,
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
  if (row >= range.count) {
    return;
  }
  const int i = range.face(row);
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

constexpr int kGaussRows = 4;    // that a warp sums at once: a face that is read meets four
constexpr int kPanelRows = 128;  // panels are whole numbers of it

/// 1/2, less i gamma W over a face itself where `miller`.
__global__ void set_diagonal(FaceView faces, SurfaceWave wave, bool miller, cuDoubleComplex* diagonal) {
  const int i = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  if (i < faces.count) {
    const double2 w = miller ? self_hypersingular(faces.face(i), wave.k, wave.alpha) : double2{0.0, 0.0};
    diagonal[i] = {0.5 + wave.gamma * w.y, -wave.gamma * w.x};
  }
}

/// 1 plus the static double layer of all other faces at each.
__global__ void __launch_bounds__(kThreads) set_gauss(FaceView faces, cuDoubleComplex* diagonal) {
  const int lane = static_cast<int>(threadIdx.x) % kWarp;
  const int first = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x) / kWarp * kGaussRows;
  Vector x[kGaussRows];
  double sum[kGaussRows] = {};
  for (int r = 0; r < kGaussRows; ++r) {
    x[r] = faces.centroid[min(first + r, faces.count - 1)];
  }
  for (int j = lane; j < faces.count; j += kWarp) {
    const Vector y = faces.centroid[j];
    const Vector weighted = faces.area[j] * faces.normal[j];
#pragma unroll
    for (int r = 0; r < kGaussRows; ++r) {
      const Vector d = x[r] - y;
      const double r2 = dot(d, d);
      const double reciprocal = reciprocal_root(r2);
      sum[r] += r2 > 0.0 ? dot(weighted, d) * (reciprocal * reciprocal * reciprocal) : 0.0;
    }
  }
#pragma unroll
  for (int r = 0; r < kGaussRows; ++r) {
    sum[r] = lane_sum<kWarp>(sum[r]);
    if (lane == 0 && first + r < faces.count) {
      diagonal[first + r] = {1.0 + sum[r] / (4.0 * kPi), 0.0};
    }
  }
}

}  // namespace

void fill_kernels(const Faces& faces, bool miller, const cuDoubleComplex* diagonal, const RowRange& rows,
                  const int* list, int columns, cuComplex* panel, int ld) {
  const PairConstants<float> constants = faces.wave().constants<float>();
  const bool damped = constants.damping != 0.0F;
  const auto kernel = miller ? (damped ? fill_values<true, true> : fill_values<true, false>)
                             : (damped ? fill_values<false, true> : fill_values<false, false>);
  launch(faces.context(), "kernels", kernel, dim3(blocks_for(rows.count, kThreads), blocks_for(columns, kFillTile)),
         kThreads, constants, faces.view(), diagonal, rows, list, columns, panel, ld);
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

Boundary::Boundary(const Faces& faces, Equation equation, const BoundaryOptions& options)
    : faces_(faces),
      context_(faces.context()),
      equation_(equation),
      options_(options),
      diagonal_(context_, faces.size()) {
  make_diagonal();
  if (equation == Equation::kBurtonMiller) {
    near_ = std::make_unique<NearCorrections>(faces, options.rule);
  }
}

void Boundary::make_diagonal() {
  if (equation_ == Equation::kPaperCorrected) {
    const int groups = (size() + kGaussRows - 1) / kGaussRows;
    launch(context_, "diagonal", set_gauss, blocks_for(std::size_t{kWarp} * groups, kThreads), kThreads, faces_.view(),
           diagonal_.data());
  } else {
    launch(context_, "diagonal", set_diagonal, blocks_for(size(), kThreads), kThreads, faces_.view(), faces_.wave(),
           equation_ == Equation::kBurtonMiller, diagonal_.data());
  }
}

void Boundary::update() {
  grid_ = nullptr;
  make_diagonal();
  if (near_) {
    near_->update();
  }
  if (is_stored_) {
    store();
  }
}

void Boundary::fill_rows(const RowRange& rows, cuComplex* panel, int ld) const {
  fill_kernels(faces_, near_ != nullptr, diagonal_.data(), rows, nullptr, size(), panel, ld);
  if (near_) {
    near_->subtract_rows(rows, panel, ld);
  }
}

void Boundary::fill_columns(const int* faces, int count, cuComplex* columns) const {
  if (near_) {
    throw std::logic_error("columns of an equation with near integrals");
  }
  fill_kernels(faces_, false, diagonal_.data(), {0, size()}, faces, count, columns, size());
}

void Boundary::store() {
  is_stored_ = false;
  stored_.resize(std::size_t{1} * size() * size());
  fill_rows({0, size()}, stored_.data(), size());
  is_stored_ = true;
}

void Boundary::forget() {
  stored_.reset();
  is_stored_ = false;
}

int Boundary::make_panel() {
  const std::size_t whole = std::size_t{blocks_for(size(), kPanelRows)} * kPanelRows;
  const std::size_t wanted =
      std::clamp(options_.panel_bytes / (size() * sizeof(cuComplex)), std::size_t{kPanelRows}, whole);
  for (int rows = static_cast<int>(wanted) / kPanelRows * kPanelRows;; rows = rows / 2 / kPanelRows * kPanelRows) {
    try {
      panel_.resize(std::size_t{1} * rows * size());
      return rows;
    } catch (const GpuMemoryFailure&) {
      if (rows < 2 * kPanelRows) {
        throw;
      }
    }
  }
}

void Boundary::apply(bool transposed, const cuComplex* x, cuComplex* y, int columns, int rough) {
  if (columns == 0) {
    return;
  }
  const int m = size();
  const auto product = [&](int rows, int depth, const cuComplex* a, int ld, const cuComplex* from, float beta,
                           cuComplex* to) {
    const cublasOperation_t op = transposed ? CUBLAS_OP_T : CUBLAS_OP_N;
    const std::size_t done = std::size_t{1} * m * rough;
    multiply(context_, op, CUBLAS_OP_N, rows, rough, depth, {1.0F, 0.0F}, a, ld, from, m, {beta, 0.0F}, to, m,
             Arithmetic::kTf32);
    multiply(context_, op, CUBLAS_OP_N, rows, columns - rough, depth, {1.0F, 0.0F}, a, ld, from + done, m, {beta, 0.0F},
             to + done, m, Arithmetic::kSingle);
  };
  if (is_stored_) {
    product(m, m, stored_.data(), m, x, 0.0F, y);
    return;
  }
  if (columns <= kFewColumns || grid_ != nullptr) {
    if (grid_ != nullptr) {
      grid_->apply(near_ != nullptr, transposed, diagonal_.data(), x, columns, y);
    } else {
      sum_kernels(faces_, near_ != nullptr, transposed, diagonal_.data(), x, columns, y, partial_);
    }
    if (near_) {
      near_->subtract_product(transposed, x, y, columns);
    }
    return;
  }
  const int rows = make_panel();
  for (int first = 0; first < m; first += rows) {
    const int taken = std::min(rows, m - first);
    fill_rows({first, taken}, panel_.data(), rows);
    if (transposed) {
      product(m, taken, panel_.data(), rows, x + first, first > 0 ? 1.0F : 0.0F, y);
    } else {
      product(taken, m, panel_.data(), rows, x, 0.0F, y + first);
    }
  }
}

}  // namespace touchfield::cuda
