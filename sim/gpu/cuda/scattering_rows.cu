#include <algorithm>
#include <cmath>
#include <numeric>

#include "sim/gpu/cuda/launch.cuh"
#include "sim/gpu/cuda/phase_steps.cuh"
#include "sim/gpu/cuda/scattering.cuh"

namespace touchfield::cuda {

namespace {

constexpr unsigned kThreads = 256;
constexpr int kPanelRows = 8192;    // points whose fields lie in double at a time
constexpr int kPolishingSteps = 2;  // as ScatteringSystem's

/// rows(i, s) = root_j from(j, s), j = list_i or, without a list, first + i; without roots 1 each
__global__ void take_rows(const int* list, int first, int count, const double* root, const cuComplex* from, int ld,
                          int columns, cuDoubleComplex* rows) {
  const std::size_t i = std::size_t{blockIdx.x} * blockDim.x + threadIdx.x;
  if (i < std::size_t{1} * count * columns) {
    const std::size_t row = list != nullptr ? list[i % count] : first + i % count;
    const double by = root != nullptr ? root[row] : 1.0;
    const cuComplex value = from[row + (i / count) * ld];
    rows[i] = make_cuDoubleComplex(by * value.x, by * value.y);
  }
}

/// rows(i, s) = sqrt(value_l) conj(vector(s, l)), l = size - 1 - i: the strongest first
__global__ void turn_vectors(const double* values, const cuDoubleComplex* vectors, int size, int count,
                             cuDoubleComplex* rows) {
  const int i = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  if (i < count * size) {
    const int from = size - 1 - i % count;
    const double root = sqrt(values[from]);
    const cuDoubleComplex value = vectors[i / count + std::size_t{1} * from * size];
    rows[i] = {root * value.x, -root * value.y};
  }
}

/// rows = L^H, of a lower triangle
__global__ void turn_factor(const cuDoubleComplex* factor, int size, cuDoubleComplex* rows) {
  const int i = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  const int s = static_cast<int>(blockIdx.y);
  if (i < size) {
    rows[i + std::size_t{1} * s * size] =
        i <= s ? cuConj(factor[s + std::size_t{1} * i * size]) : make_cuDoubleComplex(0.0, 0.0);
  }
}

__global__ void set_ones(const int* faces, int count, cuComplex* units, int ld) {
  const int c = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  if (c < count) {
    units[faces[c] + std::size_t{1} * c * ld] = make_cuComplex(1.0F, 0.0F);
  }
}

}  // namespace

/// The Gram matrix b^H b of all channels, N x N, in double: what it leaves open of the weakest drives is far below what
/// they are left out for.
void Scattering::channels_gram(Array<cuDoubleComplex>& gram) {
  const int channels = sources().size();
  Array<cuDoubleComplex> b(context_);
  Array<cuDoubleComplex> slope(context_);
  gram.resize(std::size_t{1} * channels * channels);
  for (int first = 0; first < spec_.faces; first += kPanelRows) {
    const int rows = std::min(kPanelRows, spec_.faces - first);
    const double* points = faces_.centroids() + 3 * std::size_t{1} * first;
    b.resize(std::size_t{1} * rows * channels);
    sources().incident(points, nullptr, rows, b.data());
    if (spec_.burton_miller) {
      slope.resize(b.size());
      sources().incident(points, faces_.normals() + 3 * std::size_t{1} * first, rows, slope.data());
      add(context_, {0.0, gamma()}, slope.data(), b.data(), b.size());
    }
    multiply(context_, CUBLAS_OP_C, CUBLAS_OP_N, channels, channels, rows, {1.0, 0.0}, b.data(), rows, b.data(), rows,
             {first == 0 ? 0.0 : 1.0, 0.0}, gram.data(), channels);
  }
}

/// Of a Hermitian matrix, which its eigenvectors replace; eigenvalues, ascending, none below 0.
std::vector<double> Scattering::eigen(int size, Array<cuDoubleComplex>& matrix) {
  Array<double> there(context_, static_cast<std::size_t>(size));
  hermitian_.solve(size, matrix.data(), there.data());
  std::vector<double> values(there.size());
  there.download(values.data(), values.size());
  std::transform(values.begin(), values.end(), values.begin(), [](double value) { return std::max(0.0, value); });
  return values;
}

GpuBody::Span Scattering::span(double tolerance, const GpuSolveOptions& options, const GpuProgress& progress) {
  context_.use();
  const int channels = sources().size();
  Array<cuDoubleComplex> vectors(context_);
  channels_gram(vectors);
  const std::vector<double> values = eigen(channels, vectors);
  const double total = std::accumulate(values.begin(), values.end(), 0.0);
  Span span;
  int dropped = 0;
  double left = 0;
  while (dropped < channels - 1 && left + values[static_cast<std::size_t>(dropped)] <= tolerance * tolerance * total) {
    left += values[static_cast<std::size_t>(dropped++)];
  }
  span.rank = channels - dropped;
  span.left_out = total > 0 ? std::sqrt(left / total) : 0.0;
  drives_.resize(std::size_t{1} * channels * span.rank);
  convert(context_, vectors.data() + std::size_t{1} * channels * dropped, drives_.data(), drives_.size());
  vectors.reset();
  span.report = pressures_of(drives_.data(), span.rank, false, options, progress);
  return span;
}

void Scattering::pressures(GpuComplex* all) {
  context_.use();
  const std::size_t size = std::size_t{1} * spec_.faces * columns_;
  host_.resize(size);
  convert(context_, pressure().data(), host_.data(), size);
  host_.download(reinterpret_cast<cuDoubleComplex*>(all), size);
}

/// rows V^H
void Scattering::to_channels(const cuDoubleComplex* rows, int count, GpuComplex* out) {
  if (count == 0) {
    return;
  }
  const int channels = sources().size();
  Array<cuDoubleComplex> drives(context_, drives_.size());
  convert(context_, drives_.data(), drives.data(), drives_.size());
  host_.resize(std::size_t{1} * count * channels);
  multiply(context_, CUBLAS_OP_N, CUBLAS_OP_C, count, channels, columns_, {1.0, 0.0}, rows, count, drives.data(),
           channels, {0.0, 0.0}, host_.data(), count);
  host_.download(reinterpret_cast<cuDoubleComplex*>(out), host_.size());
}

void Scattering::rows(const int* faces, int count, GpuComplex* rows) {
  context_.use();
  Array<int> list(context_);
  list.upload(faces, static_cast<std::size_t>(count));
  Array<cuDoubleComplex> gathered(context_, std::size_t{1} * count * columns_);
  launch(context_, "rows", take_rows, blocks_for(gathered.size(), kThreads), kThreads, list.data(), 0, count, nullptr,
         pressure().data(), spec_.faces, columns_, gathered.data());
  to_channels(gathered.data(), count, rows);
}

/// P^H diag(root)^2 P in double.
void Scattering::pressure_gram(const Array<double>& root, Array<cuDoubleComplex>& gram) {
  Array<cuDoubleComplex> panel(context_);
  gram.resize(std::size_t{1} * columns_ * columns_);
  for (int first = 0; first < spec_.faces; first += kPanelRows) {
    const int rows = std::min(kPanelRows, spec_.faces - first);
    const std::size_t size = std::size_t{1} * rows * columns_;
    panel.resize(size);
    launch(context_, "Gram matrix", take_rows, blocks_for(size, kThreads), kThreads, nullptr, first, rows, root.data(),
           pressure().data(), spec_.faces, columns_, panel.data());
    multiply(context_, CUBLAS_OP_C, CUBLAS_OP_N, columns_, columns_, rows, {1.0, 0.0}, panel.data(), rows, panel.data(),
             rows, {first == 0 ? 0.0 : 1.0, 0.0}, gram.data(), columns_);
  }
}

GpuBody::Reduction Scattering::reduce(const double* weights, double tolerance) {
  context_.use();
  std::vector<double> roots(weights, weights + spec_.faces);
  std::transform(roots.begin(), roots.end(), roots.begin(), [](double w) { return std::sqrt(w); });
  Array<double> root(context_);
  root.upload(roots);
  Array<cuDoubleComplex> gram(context_);
  pressure_gram(root, gram);
  if (tolerance == 0) {
    if (hermitian_.factorise(columns_, gram.data())) {
      reduced_.resize(gram.size());
      launch(context_, "outside rows", turn_factor, dim3(blocks_for(columns_, kThreads), columns_), kThreads,
             gram.data(), columns_, reduced_.data());
      return {columns_, 0.0};
    }
    pressure_gram(root, gram);
  }
  const std::vector<double> values = eigen(columns_, gram);
  const double total = std::accumulate(values.begin(), values.end(), 0.0);
  const auto kept = std::upper_bound(values.begin(), values.end(), tolerance * tolerance * values.back());
  Reduction reduction;
  reduction.rank = static_cast<int>(values.end() - kept);
  reduction.left_out = total > 0 ? std::sqrt(std::accumulate(values.begin(), kept, 0.0) / total) : 0.0;
  Array<double> there(context_);
  there.upload(values);
  reduced_.resize(std::size_t{1} * reduction.rank * columns_);
  launch(context_, "outside rows", turn_vectors, blocks_for(reduced_.size(), kThreads), kThreads, there.data(),
         gram.data(), columns_, reduction.rank, reduced_.data());
  return reduction;
}

void Scattering::reduced(GpuComplex* rows) {
  context_.use();
  to_channels(reduced_.data(), static_cast<int>(reduced_.size()) / columns_, rows);
}

std::unique_ptr<GramDevice> Scattering::incident_gram(const int* faces, int count, const double* amplitudes,
                                                      const double* weights, const GpuComplex* beyond, bool scattered) {
  context_.use();
  make_field();
  Array<cuComplex> columns(context_, std::size_t{1} * spec_.faces * count);
  if (!scattered) {
    set_units(faces, count, columns);
  } else if (spec_.burton_miller) {
    Array<cuComplex> units(context_);
    set_units(faces, count, units);
    boundary().apply(false, units.data(), columns.data(), count, 0);
  } else {
    Array<int> list(context_);
    list.upload(faces, static_cast<std::size_t>(count));
    boundary().fill_columns(list.data(), count, columns.data());
  }
  const int channels = sources().size();
  const PaperMatrices paper{spec_.faces, count,  channels, columns.data(), scattered ? right_sides() : g_.data(),
                            amplitudes,  weights};
  Array<cuDoubleComplex> gram = paper_gram(context_, paper);
  if (beyond != nullptr) {
    Array<cuDoubleComplex> more(context_);
    more.upload(reinterpret_cast<const cuDoubleComplex*>(beyond), gram.size());
    add(context_, make_cuDoubleComplex(1.0, 0.0), more.data(), gram.data(), gram.size());
  }
  return make_gram_device(context_, std::move(gram), count + channels);
}

/// units(j, c) = 1 where j is faces_c, else 0
void Scattering::set_units(const int* faces, int count, Array<cuComplex>& units) {
  Array<int> list(context_);
  list.upload(faces, static_cast<std::size_t>(count));
  units.resize(std::size_t{1} * spec_.faces * count);
  units.set_zero();
  launch(context_, "unit columns", set_ones, blocks_for(list.size(), kThreads), kThreads, list.data(), count,
         units.data(), spec_.faces);
}

GpuSolveReport Scattering::transfer_rows(const int* faces, int count, GpuComplex* rows, const GpuSolveOptions& options,
                                         const GpuProgress& progress) {
  context_.use();
  make_field();
  columns_ = 0;
  const int channels = sources().size();
  const std::size_t size = std::size_t{1} * spec_.faces * count;
  const auto subtract_plain = [&](Array<cuComplex>& r) {  // r -= B_c^T r
    polished_.resize(size);
    plain().apply(true, r.data(), polished_.data(), count, 0);
    add(context_, kMinusOne, polished_.data(), r.data(), size);
  };
  set_units(faces, count, right_);
  for (int step = 0; spec_.polished && step < kPolishingSteps; ++step) {  // H = (1 - B_c)^2 H_BM + (2 - B_c) G
    subtract_plain(right_);
  }
  x_.resize(size);
  const GpuSolveReport report = solve_columns({true, count, right_.data(), x_.data(), false}, options, progress);
  Array<cuComplex> out(context_, std::size_t{1} * count * channels);
  const cuComplex* b = right_sides();
  multiply(context_, CUBLAS_OP_T, CUBLAS_OP_N, count, channels, spec_.faces, kOne, x_.data(), spec_.faces, b,
           spec_.faces, kZero, out.data(), count, Arithmetic::kSingle);
  if (spec_.polished) {
    set_units(faces, count, right_);
    subtract_plain(right_);  // 1 - B_c^T, and once more the unit columns themselves
    set_units(faces, count, x_);
    add(context_, kOne, x_.data(), right_.data(), size);
    multiply(context_, CUBLAS_OP_T, CUBLAS_OP_N, count, channels, spec_.faces, kOne, right_.data(), spec_.faces,
             g_.data(), spec_.faces, kOne, out.data(), count, Arithmetic::kSingle);
  }
  host_.resize(out.size());
  convert(context_, out.data(), host_.data(), out.size());
  host_.download(reinterpret_cast<cuDoubleComplex*>(rows), out.size());
  return report;
}

}  // namespace touchfield::cuda
