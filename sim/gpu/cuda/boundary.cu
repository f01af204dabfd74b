#include <algorithm>
#include <stdexcept>

#include "sim/gpu/cuda/boundary.cuh"
#include "sim/gpu/cuda/launch.cuh"

namespace touchfield::cuda {

namespace {

constexpr int kThreads = 128;
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
  make_diagonal();
  if (near_) {
    near_->update();
  }
  if (is_stored_) {
    store();
  }
}

void Boundary::fill_rows(int first, int rows, cuComplex* panel, int ld) const {
  fill_kernels(faces_, near_ != nullptr, diagonal_.data(), first, rows, nullptr, size(), panel, ld);
  if (near_) {
    near_->subtract_rows(first, rows, panel, ld);
  }
}

void Boundary::fill_columns(const int* faces, int count, cuComplex* columns) const {
  if (near_) {
    throw std::logic_error("columns of an equation with near integrals");
  }
  fill_kernels(faces_, false, diagonal_.data(), 0, size(), faces, count, columns, size());
}

void Boundary::store() {
  is_stored_ = false;
  stored_.resize(std::size_t{1} * size() * size());
  fill_rows(0, size(), stored_.data(), size());
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
  if (columns <= kFewColumns) {
    sum_kernels(faces_, near_ != nullptr, transposed, diagonal_.data(), x, columns, y, partial_);
    if (near_) {
      near_->subtract_product(transposed, x, y, columns);
    }
    return;
  }
  const int rows = make_panel();
  for (int first = 0; first < m; first += rows) {
    const int taken = std::min(rows, m - first);
    fill_rows(first, taken, panel_.data(), rows);
    if (transposed) {
      product(m, taken, panel_.data(), rows, x + first, first > 0 ? 1.0F : 0.0F, y);
    } else {
      product(taken, m, panel_.data(), rows, x, 0.0F, y + first);
    }
  }
}

}  // namespace touchfield::cuda
