#include <algorithm>
#include <string>

#define TOUCHFIELD_LEVEL cuda
#include "sim/bem/grid_formulas.h"
#undef TOUCHFIELD_LEVEL
#include "sim/gpu/cuda/grid_sums.cuh"
#include "sim/gpu/cuda/launch.cuh"

namespace touchfield::cuda {

namespace {

constexpr int kThreads = 128;
constexpr int kTile = kGridTile;
constexpr int kTileThreads = kTile * kTile;  // one a row along z
constexpr int kTileFaces = 16;               // that a tile takes at once
constexpr int kSources = 128;                // faces that local sums take at once
constexpr int kParts = kThreads / kWarp;     // of the sources, a warp each
constexpr int kColumnsAtOnce = 4;            // of local sums

/// Strengths in the order of places: x, times the face's area unless transposed.
__global__ void take_strengths(FaceView faces, const int* number, bool transposed, std::size_t size, const cuComplex* x,
                               cuComplex* strength) {
  const std::size_t at = std::size_t{1} * blockIdx.x * blockDim.x + threadIdx.x;
  if (at >= size) {
    return;
  }
  const std::size_t f = number[at % faces.count];
  strength[at] = scaled(x[at / faces.count * faces.count + f], transposed ? 1.0 : faces.area[f]);
}

/// Local sums at the places of an item, a lane each; the warps of a block take a part of the sources each.
template <Layer kLayer, bool kDamped, int kColumns>
__global__ void __launch_bounds__(kThreads)
    sum_local(GridSumView view, LocalKernel<float> kernel, float unit, float cell_size, const int2* items,
              const int* cell_start, const int* source_start, const int* sources, const cuComplex* strength,
              int columns, cuComplex* sum) {
  __shared__ float3 place[kSources];
  __shared__ float3 normal[kSources];
  __shared__ cuComplex value[kSources * kColumns];
  __shared__ cuComplex parts[kParts][kWarp * kColumns];
  const int thread = static_cast<int>(threadIdx.x);
  const int lane = thread % kWarp;
  const int part = thread / kWarp;
  const int2 item = items[blockIdx.x];
  const int end = cell_start[item.x + 1];
  const int p = item.y + lane;
  const GridFace own = view.face[min(p, end - 1)];
  cuComplex found[kColumns] = {};
  const int last = source_start[item.x + 1];
  for (int first = source_start[item.x]; first < last; first += kSources) {
    const int count = min(kSources, last - first);
    __syncthreads();
    if (thread < count) {
      const int q = sources[first + thread];
      const GridFace other = view.face[q];
      place[thread] = {other.place.x + cell_size * static_cast<float>(other.cell.x - own.cell.x),
                       other.place.y + cell_size * static_cast<float>(other.cell.y - own.cell.y),
                       other.place.z + cell_size * static_cast<float>(other.cell.z - own.cell.z)};
      normal[thread] = other.normal;
      for (int s = 0; s < kColumns; ++s) {
        value[thread * kColumns + s] = s < columns ? strength[q + std::size_t{1} * s * view.count] : cuComplex{};
      }
    }
    __syncthreads();
    for (int j = part; j < count; j += kParts) {
      const float3 y = place[j];
      const float3 n = normal[j];
      const float dx = own.place.x - y.x;
      const float dy = own.place.y - y.y;
      const float dz = own.place.z - y.z;
      const float r2 = dx * dx + dy * dy + dz * dz;
      if (r2 >= 1.0F) {
        continue;
      }
      const float nd = n.x * dx + n.y * dy + n.z * dz;
      const float md = own.normal.x * dx + own.normal.y * dy + own.normal.z * dz;
      const float mn = own.normal.x * n.x + own.normal.y * n.y + own.normal.z * n.z;
      float re;
      float im;
      local_kernel<kLayer, kDamped>(kernel, r2, reciprocal_root(r2), nd, md, mn, re, im);
#pragma unroll
      for (int s = 0; s < kColumns; ++s) {
        const cuComplex v = value[j * kColumns + s];
        found[s].x += re * v.x - im * v.y;
        found[s].y += re * v.y + im * v.x;
      }
    }
  }
#pragma unroll
  for (int s = 0; s < kColumns; ++s) {
    parts[part][lane * kColumns + s] = found[s];
  }
  __syncthreads();
  if (part == 0 && p < end) {
    for (int s = 0; s < columns; ++s) {
      cuComplex whole = parts[0][lane * kColumns + s];
      for (int other = 1; other < kParts; ++other) {
        whole = cuCaddf(whole, parts[other][lane * kColumns + s]);
      }
      sum[p + std::size_t{1} * s * view.count] = {unit * whole.x, unit * whole.y};
    }
  }
}

template <int kColumns>
auto local_kernel_of(bool miller, bool transposed, bool damped) {
  decltype(&sum_local<Layer::kDouble, false, kColumns>) const kernels[2][2][2] = {
      {{sum_local<Layer::kDouble, false, kColumns>, sum_local<Layer::kDouble, true, kColumns>},
       {sum_local<Layer::kAdjoint, false, kColumns>, sum_local<Layer::kAdjoint, true, kColumns>}},
      {{sum_local<Layer::kBurtonMiller, false, kColumns>, sum_local<Layer::kBurtonMiller, true, kColumns>},
       {sum_local<Layer::kAdjointMiller, false, kColumns>, sum_local<Layer::kAdjointMiller, true, kColumns>}}};
  return kernels[miller][transposed][damped];
}

/// Writes a tile of the grid: what the windows of the faces that meet it bring there, strength times `charge` as
/// charges and times `dipole` as dipoles. A thread a row along z.
__global__ void __launch_bounds__(kTileThreads) spread(GridSumView view, int3 tiles, const int* start, const int* faces,
                                                       const cuComplex* strength, float charge, cuComplex dipole) {
  __shared__ __align__(16) float weights[kTileFaces][6][kTile];
  __shared__ cuComplex charges[kTileFaces];
  __shared__ cuComplex dipoles[kTileFaces];
  const int thread = static_cast<int>(threadIdx.x);
  const int x = thread / kTile;
  const int y = thread % kTile;
  const int tile = static_cast<int>(blockIdx.x);
  const int corner[3] = {tile / tiles.z / tiles.y * kTile, tile / tiles.z % tiles.y * kTile, tile % tiles.z * kTile};
  float re[kTile] = {};
  float im[kTile] = {};
  const int end = start[tile + 1];
  for (int begin = start[tile]; begin < end; begin += kTileFaces) {
    const int count = min(kTileFaces, end - begin);
    __syncthreads();
    for (int i = thread; i < count * 6 * kTile; i += kTileThreads) {
      const int l = i % kTile;
      const int row = i / kTile % 6;
      const int p = faces[begin + i / (6 * kTile)];
      const int3 first = view.face[p].first;
      const int axis = row / 2;
      const int in_window = (axis == 0   ? corner[0] - first.x
                             : axis == 1 ? corner[1] - first.y
                                         : corner[2] - first.z) +
                            l;
      const bool inside = in_window >= 0 && in_window < view.width;
      weights[i / (6 * kTile)][row][l] =
          inside ? view.weight[(std::size_t{6} * p + row) * view.width + in_window] : 0.0F;
    }
    if (thread < count) {
      const cuComplex v = strength[faces[begin + thread]];
      charges[thread] = {charge * v.x, charge * v.y};
      dipoles[thread] = cuCmulf(dipole, v);
    }
    __syncthreads();
    for (int f = 0; f < count; ++f) {
      const float wx = weights[f][0][x];
      const float wy = weights[f][2][y];
      const float weight = wx * wy;
      const float slope = weights[f][1][x] * wy + wx * weights[f][3][y];
      const cuComplex q = charges[f];
      const cuComplex d = dipoles[f];
      const float a_re = q.x * weight + d.x * slope;
      const float a_im = q.y * weight + d.y * slope;
      const float b_re = d.x * weight;
      const float b_im = d.y * weight;
#pragma unroll
      for (int z = 0; z < kTile; ++z) {
        const float wz = weights[f][4][z];
        const float dz = weights[f][5][z];
        re[z] += a_re * wz + b_re * dz;
        im[z] += a_im * wz + b_im * dz;
      }
    }
  }
  if (corner[0] + x < view.points.x && corner[1] + y < view.points.y) {
    cuComplex* row =
        view.grid + (std::size_t{1} * (corner[0] + x) * view.period.y + corner[1] + y) * view.period.z + corner[2];
#pragma unroll
    for (int z = 0; z < kTile; ++z) {
      if (corner[2] + z < view.points.z) {
        row[z] = {re[z], im[z]};
      }
    }
  }
}

__global__ void multiply_by_symbol(int3 period, const cuComplex* symbol, cuComplex* grid) {
  const int z = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  const int y = static_cast<int>(blockIdx.y);
  const int x = static_cast<int>(blockIdx.z);
  if (z >= period.z) {
    return;
  }
  const auto folded = [](int i, int n) { return min(i, n - i); };
  const int half_y = period.y / 2 + 1;
  const int half_z = period.z / 2 + 1;
  const cuComplex factor =
      symbol[(std::size_t{1} * folded(x, period.x) * half_y + folded(y, period.y)) * half_z + folded(z, period.z)];
  cuComplex& value = grid[(std::size_t{1} * x * period.y + y) * period.z + z];
  value = cuCmulf(factor, value);
}

/// Reads the grid at each place and adds value times `value_factor` and slope along the normal times `slope_factor`; a
/// warp a place, kLanes points of the window along z side by side.
template <int kLanes>
__global__ void __launch_bounds__(kThreads)
    interpolate(GridSumView view, float value_factor, cuComplex slope_factor, cuComplex* sum) {
  constexpr int kRows = kWarp / kLanes;
  const int lane = static_cast<int>(threadIdx.x) % kWarp;
  const int p = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x) / kWarp;
  if (p >= view.count) {  // the whole warp
    return;
  }
  const int width = view.width;
  const int3 first = view.face[p].first;
  const float* wx = view.weight + std::size_t{6} * p * width;
  const float* wy = wx + 2 * width;
  const float* wz = wx + 4 * width;
  const int iz = lane % kLanes;
  const cuComplex* corner =
      view.grid + (std::size_t{1} * first.x * view.period.y + first.y) * view.period.z + first.z + iz;
  cuComplex w = {0.0F, 0.0F};
  cuComplex s = {0.0F, 0.0F};
  if (iz < width) {
    for (int row = lane / kLanes; row < width * width; row += kRows) {
      const int ix = row / width;
      const int iy = row % width;
      const float weight = wx[ix] * wy[iy];
      const float slope = wx[width + ix] * wy[iy] + wx[ix] * wy[width + iy];
      const cuComplex value = corner[(std::size_t{1} * ix * view.period.y + iy) * view.period.z];
      w = {w.x + weight * value.x, w.y + weight * value.y};
      s = {s.x + slope * value.x, s.y + slope * value.y};
    }
  }
  const float at = iz < width ? wz[iz] : 0.0F;
  const float along = iz < width ? wz[width + iz] : 0.0F;
  cuComplex value = {at * w.x, at * w.y};
  cuComplex slope = {at * s.x + along * w.x, at * s.y + along * w.y};
#pragma unroll
  for (int apart = 1; apart < kWarp; apart *= 2) {
    value.x += __shfl_xor_sync(kAllLanes, value.x, apart);
    value.y += __shfl_xor_sync(kAllLanes, value.y, apart);
    slope.x += __shfl_xor_sync(kAllLanes, slope.x, apart);
    slope.y += __shfl_xor_sync(kAllLanes, slope.y, apart);
  }
  if (lane == 0) {
    const cuComplex turned = cuCmulf(slope_factor, slope);
    sum[p] = {sum[p].x + value_factor * value.x + turned.x, sum[p].y + value_factor * value.y + turned.y};
  }
}

/// y = diagonal x - the sums, times the area of the point where they lack it.
__global__ void finish_grid_sums(FaceView faces, const int* number, bool transposed, const cuDoubleComplex* diagonal,
                                 std::size_t size, const cuComplex* x, const cuComplex* sum, cuComplex* y) {
  const std::size_t at = std::size_t{1} * blockIdx.x * blockDim.x + threadIdx.x;
  if (at >= size) {
    return;
  }
  const std::size_t f = number[at % faces.count];
  const std::size_t i = at / faces.count * faces.count + f;
  const double scale = transposed ? faces.area[f] : 1.0;
  const cuDoubleComplex d = diagonal[f];
  const cuComplex v = x[i];
  y[i] = {static_cast<float>(d.x * v.x - d.y * v.y - scale * sum[at].x),
          static_cast<float>(d.x * v.y + d.y * v.x - scale * sum[at].y)};
}

}  // namespace

void check(cufftResult result, const char* what) {
  if (result == CUFFT_ALLOC_FAILED) {
    throw GpuMemoryFailure(std::string("graphics card: ") + what + ": out of memory");
  }
  if (result != CUFFT_SUCCESS) {
    throw GpuFailure(std::string("graphics card: ") + what + ": cuFFT's status " + std::to_string(result));
  }
}

GridTransform::~GridTransform() {
  if (is_made_) {
    cufftDestroy(plan_);
  }
}

void GridTransform::make(Context& context, int3 period) {
  std::size_t bytes = 0;
  check(cufftCreate(&plan_), "Fourier transform");
  is_made_ = true;
  check(cufftSetAutoAllocation(plan_, 0), "Fourier transform");
  check(cufftMakePlan3d(plan_, period.x, period.y, period.z, CUFFT_C2C, &bytes), "Fourier transform");
  work_.resize(std::max(bytes, std::size_t{1}));
  check(cufftSetWorkArea(plan_, work_.data()), "Fourier transform");
  check(cufftSetStream(plan_, context.stream()), "Fourier transform");
}

void GridTransform::run(cuComplex* grid, int direction) {
  check(cufftExecC2C(plan_, grid, grid, direction), "Fourier transform");
}

GridSums::GridSums(const Faces& faces, const GpuGrid& grid)
    : faces_(faces),
      context_(faces.context()),
      tolerance_(grid.tolerance),
      local_(grid.local),
      local_unit_(static_cast<float>(1.0 / (4.0 * kPi * grid.reach * grid.reach))) {
  const int3 period = {grid.period[0], grid.period[1], grid.period[2]};
  const int3 points = {grid.points[0], grid.points[1], grid.points[2]};
  symbol_.upload(reinterpret_cast<const cuComplex*>(grid.symbol.data()), grid.symbol.size());
  grid_.resize(std::size_t{1} * period.x * period.y * period.z);
  transform_.make(context_, period);
  const auto count = static_cast<std::size_t>(faces.size());
  face_.resize(count);
  weight_.resize(count * 6 * grid.width);
  sort_faces(grid);
  view_ = {faces.size(), grid.width, points, period, face_.data(), number_.data(), weight_.data(), grid_.data()};
  make_tiles();
}

/// Adds the smooth part of one column to sum_, as touchfield::GridSum does.
void GridSums::add_smooth(bool miller, bool transposed, const cuComplex* strength, cuComplex* sum) {
  const auto gamma = static_cast<float>(faces_.wave().gamma);
  const cuComplex none = {0.0F, 0.0F};
  const cuComplex one = {1.0F, 0.0F};
  const cuComplex turned = {0.0F, gamma};
  const float charge = transposed ? 1.0F : 0.0F;
  const cuComplex dipole = !transposed ? one : (miller ? turned : none);
  const float value = transposed ? 0.0F : 1.0F;
  const cuComplex slope = transposed ? one : (miller ? turned : none);
  grid_.set_zero();
  launch(context_, "spread", spread, static_cast<unsigned>(tiles_.x * tiles_.y * tiles_.z), kTileThreads, view_, tiles_,
         tile_start_.data(), tile_face_.data(), strength, charge, dipole);
  transform_.run(grid_.data(), CUFFT_FORWARD);
  launch(context_, "symbol", multiply_by_symbol,
         dim3(blocks_for(view_.period.z, kThreads), view_.period.y, view_.period.x), kThreads, view_.period,
         symbol_.data(), grid_.data());
  transform_.run(grid_.data(), CUFFT_INVERSE);
  launch(context_, "interpolate", view_.width <= 8 ? interpolate<8> : interpolate<16>,
         blocks_for(std::size_t{kWarp} * view_.count, kThreads), kThreads, view_, value, slope, sum);
}

void GridSums::apply(bool miller, bool transposed, const cuDoubleComplex* diagonal, const cuComplex* x, int columns,
                     cuComplex* y) {
  const std::size_t size = std::size_t{1} * view_.count * columns;
  strength_.resize(size);
  sum_.resize(size);
  launch(context_, "strengths", take_strengths, blocks_for(size, kThreads), kThreads, faces_.view(), number_.data(),
         transposed, size, x, strength_.data());
  for (int first = 0; first < columns; first += kColumnsAtOnce) {
    const int taken = std::min(kColumnsAtOnce, columns - first);
    const std::size_t begin = std::size_t{1} * first * view_.count;
    launch(context_, "local sums",
           taken == 1 ? local_kernel_of<1>(miller, transposed, local_.damped)
                      : local_kernel_of<kColumnsAtOnce>(miller, transposed, local_.damped),
           static_cast<unsigned>(item_.size()), kThreads, view_, local_, local_unit_, cell_size_, item_.data(),
           cell_start_.data(), source_start_.data(), source_.data(), strength_.data() + begin, taken,
           sum_.data() + begin);
    for (int s = first; s < first + taken; ++s) {
      const std::size_t column = std::size_t{1} * s * view_.count;
      add_smooth(miller, transposed, strength_.data() + column, sum_.data() + column);
    }
  }
  launch(context_, "sums", finish_grid_sums, blocks_for(size, kThreads), kThreads, faces_.view(), number_.data(),
         transposed, diagonal, size, x, sum_.data(), y);
}

}  // namespace touchfield::cuda
