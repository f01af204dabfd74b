#include <algorithm>

#include "sim/gpu/cuda/boundary.cuh"

namespace touchfield::cuda {

namespace {

constexpr unsigned kThreads = 128;
constexpr int kGaussChunk = 512;  // sources a block
constexpr int kFewestRows = 128;  // of a panel
constexpr int kRowUnit = 128;     // panels are whole numbers of it

__global__ void set_half(int size, cuDoubleComplex* diagonal) {
  const int i = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  if (i < size) {
    diagonal[i] = {0.5, 0.0};
  }
}

__global__ void set_self(FaceView faces, SurfaceWave wave, cuDoubleComplex* diagonal) {
  const int i = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  if (i < faces.count) {
    const Triangle face = faces.face(i);
    const double2 w = self_hypersingular(face.a, face.b, face.c, wave.k, wave.alpha);
    diagonal[i] = {0.5 + wave.gamma * w.y, -wave.gamma * w.x};
  }
}

/// Static double layers of the sources of one chunk at every point.
__global__ void __launch_bounds__(kThreads) sum_static(FaceView faces, double* partial) {
  __shared__ Vector centroid[kThreads];
  __shared__ Vector weighted[kThreads];  // A n
  const int t = static_cast<int>(threadIdx.x);
  const int row = static_cast<int>(blockIdx.x * kThreads) + t;
  const Vector x = faces.centroid[min(row, faces.count - 1)];
  const int begin = static_cast<int>(blockIdx.y) * kGaussChunk;
  const int end = min(begin + kGaussChunk, faces.count);
  double sum = 0.0;
  for (int tile = begin; tile < end; tile += static_cast<int>(kThreads)) {
    const int count = min(static_cast<int>(kThreads), end - tile);
    __syncthreads();
    if (t < count) {
      centroid[t] = faces.centroid[tile + t];
      weighted[t] = faces.area[tile + t] * faces.normal[tile + t];
    }
    __syncthreads();
    for (int j = 0; j < count; ++j) {
      const Vector d = x - centroid[j];
      const double r2 = dot(d, d);
      const double reciprocal = reciprocal_root(r2);
      sum += r2 > 0.0 ? dot(weighted[j], d) * (reciprocal * reciprocal * reciprocal) : 0.0;
    }
  }
  if (row < faces.count) {
    partial[static_cast<std::size_t>(blockIdx.y) * static_cast<std::size_t>(faces.count) +
            static_cast<std::size_t>(row)] = sum;
  }
}

__global__ void set_gauss(const double* partial, int chunks, int size, cuDoubleComplex* diagonal) {
  const int i = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  if (i < size) {
    double sum = 0.0;
    for (int chunk = 0; chunk < chunks; ++chunk) {
      sum += partial[static_cast<std::size_t>(chunk) * static_cast<std::size_t>(size) + static_cast<std::size_t>(i)];
    }
    diagonal[i] = {1.0 + sum / (4.0 * kPi), 0.0};
  }
}

}  // namespace

Boundary::Boundary(const Faces& faces, Equation equation, const BoundaryOptions& options)
    : faces_(faces),
      equation_(equation),
      layer_(equation == Equation::kBurtonMiller ? Layer::kBurtonMiller : Layer::kDouble),
      options_(options),
      diagonal_(faces.context()),
      stored_(faces.context()),
      panel_(faces.context()),
      partial_(faces.context()),
      gauss_partial_(faces.context()),
      list_(faces.context()) {
  make_diagonal();
  if (equation == Equation::kBurtonMiller) {
    near_ = std::make_unique<NearCorrections>(faces, layer_, options.rule, options.differences);
  }
}

void Boundary::make_diagonal() {
  Context& context = faces_.context();
  const int size = faces_.size();
  const auto stream = context.stream();
  const unsigned blocks = blocks_for(static_cast<std::size_t>(size), kThreads);
  diagonal_.resize(static_cast<std::size_t>(size));
  if (equation_ == Equation::kPaper) {
    set_half<<<blocks, kThreads, 0, stream>>>(size, diagonal_.data());
  } else if (equation_ == Equation::kBurtonMiller) {
    set_self<<<blocks, kThreads, 0, stream>>>(faces_.view(), faces_.wave(), diagonal_.data());
  } else {
    const unsigned chunks = blocks_for(static_cast<std::size_t>(size), kGaussChunk);
    gauss_partial_.resize(static_cast<std::size_t>(chunks) * static_cast<std::size_t>(size));
    sum_static<<<dim3(blocks, chunks), kThreads, 0, stream>>>(faces_.view(), gauss_partial_.data());
    context.launched("diagonal");
    set_gauss<<<blocks, kThreads, 0, stream>>>(gauss_partial_.data(), static_cast<int>(chunks), size, diagonal_.data());
  }
  context.launched("diagonal");
}

void Boundary::update() {
  make_diagonal();
  if (near_) {
    near_->update();
  }
  if (is_stored_) {
    store();
  }
}

void Boundary::fill_rows(int first, int rows, cuComplex* panel, int ld) const {
  fill_kernels(faces_, layer_, options_.differences, -1.0F, first, rows, nullptr, size(), diagonal_.data(), panel, ld);
  if (near_) {
    near_->add_to_rows(-1.0F, first, rows, panel, ld);
  }
}

void Boundary::columns(const int* faces, int count, cuComplex* out, int ld) {
  if (count == 0) {
    return;
  }
  list_.resize(static_cast<std::size_t>(count));
  check(cudaMemcpyAsync(list_.data(), faces, list_.size() * sizeof(int), cudaMemcpyDefault, faces_.context().stream()),
        "columns");
  fill_kernels(faces_, layer_, options_.differences, -1.0F, 0, size(), list_.data(), count, diagonal_.data(), out, ld);
  if (near_) {
    near_->add_to_columns(-1.0F, list_.data(), count, out, ld);
  }
}

void Boundary::store() {
  is_stored_ = false;
  stored_.resize(static_cast<std::size_t>(size()) * static_cast<std::size_t>(size()));
  fill_rows(0, size(), stored_.data(), size());
  is_stored_ = true;
}

void Boundary::forget() {
  stored_.reset();
  is_stored_ = false;
}

int Boundary::make_panel() {
  const std::size_t row_bytes = static_cast<std::size_t>(size()) * sizeof(cuComplex);
  const std::size_t whole = (static_cast<std::size_t>(size()) + kRowUnit - 1) / kRowUnit * kRowUnit;
  const std::size_t wanted = std::clamp(options_.panel_bytes / row_bytes, std::size_t{kFewestRows}, whole);
  for (int rows = static_cast<int>(wanted) / kRowUnit * kRowUnit;; rows = rows / 2 / kRowUnit * kRowUnit) {
    try {
      panel_.resize(static_cast<std::size_t>(rows) * static_cast<std::size_t>(size()));
      return rows;
    } catch (const GpuMemoryFailure&) {
      if (rows < 2 * kFewestRows) {
        throw;
      }
    }
  }
}

void Boundary::apply(bool transposed, const cuComplex* x, cuComplex* y, int columns, Arithmetic arithmetic) {
  if (columns == 0) {
    return;
  }
  Context& context = faces_.context();
  const int m = size();
  const cuComplex one{1.0F, 0.0F};
  const cuComplex zero{0.0F, 0.0F};
  const cublasOperation_t op = transposed ? CUBLAS_OP_T : CUBLAS_OP_N;
  if (is_stored_) {
    multiply(context, op, CUBLAS_OP_N, m, columns, m, one, stored_.data(), m, x, m, zero, y, m, arithmetic);
    return;
  }
  if (columns <= kFewColumns) {
    sum_kernels(faces_, layer_, options_.differences, transposed, -1.0F, diagonal_.data(), x, columns, y, partial_);
    if (near_) {
      transposed ? near_->add_transposed_product(-1.0F, x, y, columns) : near_->add_product(-1.0F, x, y, columns);
    }
    return;
  }
  const int rows = make_panel();
  for (int first = 0; first < m; first += rows) {
    const int taken = std::min(rows, m - first);
    fill_rows(first, taken, panel_.data(), rows);
    if (transposed) {
      multiply(context, op, CUBLAS_OP_N, m, columns, taken, one, panel_.data(), rows, x + first, m,
               first == 0 ? zero : one, y, m, arithmetic);
    } else {
      multiply(context, op, CUBLAS_OP_N, taken, columns, m, one, panel_.data(), rows, x, m, zero, y + first, m,
               arithmetic);
    }
  }
}

}  // namespace touchfield::cuda
