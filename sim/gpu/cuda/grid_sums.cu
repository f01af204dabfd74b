#include <algorithm>
#include <cmath>
#include <cub/device/device_radix_sort.cuh>
#include <cub/device/device_scan.cuh>
#include <thrust/binary_search.h>
#include <thrust/execution_policy.h>
#include <thrust/iterator/counting_iterator.h>

#define TOUCHFIELD_LEVEL cuda
#include "sim/bem/grid_formulas.h"
#undef TOUCHFIELD_LEVEL
#include "sim/gpu/cuda/grid_sums.cuh"
#include "sim/gpu/cuda/launch.cuh"

namespace touchfield::cuda {

namespace {

constexpr int kThreads = 128;
constexpr int kTile = 8;                     // points of a tile of the grid along each axis
constexpr int kTileThreads = kTile * kTile;  // one a row along z
constexpr int kTileFaces = 16;               // that a tile takes at once
constexpr int kSources = 128;                // faces that local sums take at once
constexpr int kParts = kThreads / kWarp;     // of the sources, a warp each
constexpr int kColumnsAtOnce = 4;            // of local sums

__device__ int3 operator/(int3 a, int b) { return {a.x / b, a.y / b, a.z / b}; }
__device__ int number_of_cell(int3 cells, int3 c) { return (c.x * cells.y + c.y) * cells.z + c.z; }

/// Where faces lie on the grid.
struct GridPlaces {
  Vector origin;
  double step, reach;
  int3 most;  // the last whole step along each axis
  int side;   // of cells, in steps
  int3 cells;

  __device__ Vector place(const Vector& at) const { return (1.0 / step) * (at - origin); }
  __device__ int3 whole(const Vector& at) const {
    const auto clamped = [](double v, int largest) { return max(0, min(static_cast<int>(floor(v)), largest)); };
    return {clamped(at.x, most.x), clamped(at.y, most.y), clamped(at.z, most.z)};
  }
};

__global__ void find_cells(FaceView faces, GridPlaces grid, int* cell, int* number) {
  const int f = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  if (f < faces.count) {
    cell[f] = number_of_cell(grid.cells, grid.whole(grid.place(faces.centroid[f])) / grid.side);
    number[f] = f;
  }
}

/// The window's weights of a place between two points and their slopes, times `along` for each.
__device__ void window_weights(int width, int lanes, const float* window, float place, float along, float* weight,
                               float* slope) {
  const float t = 2.0F * place - 1.0F;
  for (int l = 0; l < width; ++l) {
    float w = window[l];
    float s = 0.0F;
    for (int c = 1; c <= kWindowDegree; ++c) {
      s = s * t + w;
      w = w * t + window[c * lanes + l];
    }
    weight[l] = w;
    slope[l] = 2.0F * s * along;
  }
}

__global__ void place_faces(FaceView faces, GridPlaces grid, const int* number, int width, int lanes,
                            const float* window, GridFace* face, float* weight) {
  const int p = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  if (p >= faces.count) {
    return;
  }
  const int f = number[p];
  const Vector at = grid.place(faces.centroid[f]);
  const Vector n = faces.normal[f];
  const int3 whole = grid.whole(at);
  const int3 cell = whole / grid.side;
  const auto in_cell = [&](double place, int c) {
    return static_cast<float>((place - grid.side * (c + 0.5)) * (grid.step / grid.reach));
  };
  face[p] = {{in_cell(at.x, cell.x), in_cell(at.y, cell.y), in_cell(at.z, cell.z)},
             {static_cast<float>(n.x), static_cast<float>(n.y), static_cast<float>(n.z)},
             cell,
             whole};
  float* of_face = weight + std::size_t{6} * p * width;
  const double rest[3] = {at.x - whole.x, at.y - whole.y, at.z - whole.z};
  const double along[3] = {n.x, n.y, n.z};
  for (int axis = 0; axis < 3; ++axis, of_face += 2 * width) {
    window_weights(width, lanes, window, static_cast<float>(rest[axis]), static_cast<float>(along[axis] / grid.step),
                   of_face, of_face + width);
  }
}

/// Tiles that a face's window meets: how many, or with kFill their numbers and the face's place from start[p] on.
template <bool kFill>
__global__ void find_tiles(GridSumView view, int3 tiles, const int* start, int* count, int* tile, int* place) {
  const int p = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  if (p >= view.count) {
    return;
  }
  const int3 first = view.face[p].first;
  const int last = view.width - 1;
  const int3 from = first / kTile;
  const int3 to = int3{first.x + last, first.y + last, first.z + last} / kTile;
  if (!kFill) {
    count[p] = (to.x - from.x + 1) * (to.y - from.y + 1) * (to.z - from.z + 1);
    return;
  }
  int at = start[p];
  for (int x = from.x; x <= to.x; ++x) {
    for (int y = from.y; y <= to.y; ++y) {
      for (int z = from.z; z <= to.z; ++z, ++at) {
        tile[at] = number_of_cell(tiles, {x, y, z});
        place[at] = p;
      }
    }
  }
}

/// Places within reach of a cell's faces, in the order of places: how many, or with kFill the places from start on. A
/// warp a cell.
template <bool kFill>
__global__ void find_sources(GridSumView view, int3 cells, float cell_size, const int* cell_start, const int* start,
                             int* count, int* source) {
  const int lane = static_cast<int>(threadIdx.x) % kWarp;
  const int c = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x) / kWarp;
  if (c >= cells.x * cells.y * cells.z) {  // the whole warp
    return;
  }
  const int begin = cell_start[c];
  const int end = cell_start[c + 1];
  if (begin == end) {
    if (!kFill && lane == 0) {
      count[c] = 0;
    }
    return;
  }
  float3 low = {cell_size, cell_size, cell_size};
  float3 high = {-cell_size, -cell_size, -cell_size};
  for (int p = begin; p < end; ++p) {
    const float3 at = view.face[p].place;
    low = {fminf(low.x, at.x), fminf(low.y, at.y), fminf(low.z, at.z)};
    high = {fmaxf(high.x, at.x), fmaxf(high.y, at.y), fmaxf(high.z, at.z)};
  }
  const int z = c % cells.z;
  const int y = c / cells.z % cells.y;
  const int x = c / cells.z / cells.y;
  const int far = static_cast<int>(ceilf(1.0F / cell_size));
  const unsigned before = (1U << static_cast<unsigned>(lane)) - 1U;
  int found = kFill ? start[c] : 0;
  for (int i = max(0, x - far); i <= min(cells.x - 1, x + far); ++i) {
    for (int j = max(0, y - far); j <= min(cells.y - 1, y + far); ++j) {
      const int row = number_of_cell(cells, {i, j, 0});
      const int last = cell_start[row + min(cells.z - 1, z + far) + 1];
      for (int first = cell_start[row + max(0, z - far)]; first < last; first += kWarp) {
        const int p = first + lane;
        bool near = false;
        if (p < last) {
          const GridFace& other = view.face[p];
          const auto beyond = [&](float at, int steps, float least, float most) {
            const float moved = at + cell_size * static_cast<float>(steps);
            return moved - fmaxf(least, fminf(most, moved));
          };
          const float dx = beyond(other.place.x, i - x, low.x, high.x);
          const float dy = beyond(other.place.y, j - y, low.y, high.y);
          const float dz = beyond(other.place.z, other.cell.z - z, low.z, high.z);
          near = dx * dx + dy * dy + dz * dz < 1.0F;
        }
        const unsigned hits = __ballot_sync(kAllLanes, near);
        if (kFill && near) {
          source[found + __popc(hits & before)] = p;
        }
        found += __popc(hits);
      }
    }
  }
  if (!kFill && lane == 0) {
    count[c] = found;
  }
}

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
__global__ void __launch_bounds__(kTileThreads)
    spread(GridSumView view, int3 tiles, const int* start, const int* faces, const cuComplex* strength, float charge,
           cuComplex dipole) {
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

/// The first of each number 0 .. count in sorted ones.
void find_starts(Context& context, const Array<int>& sorted, int count, Array<int>& start) {
  const thrust::counting_iterator<int> numbers(0);
  start.resize(static_cast<std::size_t>(count) + 1);
  thrust::lower_bound(thrust::cuda::par.on(context.stream()), sorted.data(), sorted.data() + sorted.size(), numbers,
                      numbers + count + 1, start.data());
}

/// Sorts numbers below `most`, and what goes with them, keeping the order of equal ones.
void sort_pairs(Context& context, int most, const Array<int>& key, const Array<int>& value, Array<int>& sorted,
                Array<int>& moved) {
  const auto count = static_cast<int>(key.size());
  sorted.resize(key.size());
  moved.resize(key.size());
  int bits = 1;
  while (bits < 31 && most >> bits > 0) {
    ++bits;
  }
  with_room(context, "sort", [&](void* room, std::size_t& bytes) {
    return cub::DeviceRadixSort::SortPairs(room, bytes, key.data(), sorted.data(), value.data(), moved.data(), count, 0,
                                           bits, context.stream());
  });
}

/// Begins of lists whose lengths are given, with a 0 at the end; returns how long they are together.
int add_up(Context& context, const Array<int>& count, Array<int>& start) {
  start.resize(count.size());
  with_room(context, "lists", [&](void* room, std::size_t& bytes) {
    return cub::DeviceScan::ExclusiveSum(room, bytes, count.data(), start.data(), static_cast<int>(count.size()),
                                         context.stream());
  });
  return start.value(count.size() - 1);
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
  view_ = {faces.size(), grid.width,     points,         period,
           face_.data(), number_.data(), weight_.data(), grid_.data()};
  make_tiles();
}

void GridSums::sort_faces(const GpuGrid& grid) {
  constexpr double kCells = 2.0;  // a reach
  GridPlaces places{};
  places.origin = {grid.origin[0], grid.origin[1], grid.origin[2]};
  places.step = grid.step;
  places.reach = grid.reach;
  places.side = std::max(1, static_cast<int>(std::ceil(grid.reach / (kCells * grid.step))));
  places.most = {grid.points[0] - grid.width, grid.points[1] - grid.width, grid.points[2] - grid.width};
  places.cells = {places.most.x / places.side + 1, places.most.y / places.side + 1, places.most.z / places.side + 1};
  cells_ = places.cells;
  const auto count = static_cast<std::size_t>(faces_.size());
  const int cells = cells_.x * cells_.y * cells_.z;
  Array<float> window(context_);
  window.upload(grid.window);
  Array<int> cell(context_, count);
  Array<int> face(context_, count);
  Array<int> sorted(context_);
  const unsigned blocks = blocks_for(count, kThreads);
  launch(context_, "cells", find_cells, blocks, kThreads, faces_.view(), places, cell.data(), face.data());
  sort_pairs(context_, cells, cell, face, sorted, number_);
  find_starts(context_, sorted, cells, cell_start_);
  launch(context_, "cells", place_faces, blocks, kThreads, faces_.view(), places, number_.data(), grid.width,
         grid.lanes, window.data(), face_.data(), weight_.data());
  std::vector<int> start(static_cast<std::size_t>(cells) + 1);
  cell_start_.download(start.data(), start.size());
  std::vector<int2> items;
  for (int c = 0; c < cells; ++c) {
    for (int p = start[static_cast<std::size_t>(c)]; p < start[static_cast<std::size_t>(c) + 1]; p += kWarp) {
      items.push_back({c, p});
    }
  }
  item_.upload(items);
  view_.count = faces_.size();
  view_.face = face_.data();
  make_sources(static_cast<float>(places.side * grid.step / grid.reach));
}

void GridSums::make_sources(float cell_size) {
  cell_size_ = cell_size;
  const int cells = cells_.x * cells_.y * cells_.z;
  const unsigned blocks = blocks_for(std::size_t{kWarp} * cells, kThreads);
  Array<int> count(context_, static_cast<std::size_t>(cells) + 1);
  count.set_zero();
  launch(context_, "faces within reach", find_sources<false>, blocks, kThreads, view_, cells_, cell_size,
         cell_start_.data(), nullptr, count.data(), nullptr);
  source_.resize(add_up(context_, count, source_start_));
  launch(context_, "faces within reach", find_sources<true>, blocks, kThreads, view_, cells_, cell_size,
         cell_start_.data(), source_start_.data(), nullptr, source_.data());
}

void GridSums::make_tiles() {
  const auto along = [](int points) { return (points + kTile - 1) / kTile; };
  tiles_ = {along(view_.points.x), along(view_.points.y), along(view_.points.z)};
  const int tiles = tiles_.x * tiles_.y * tiles_.z;
  const unsigned blocks = blocks_for(view_.count, kThreads);
  Array<int> count(context_, static_cast<std::size_t>(view_.count) + 1);
  count.set_zero();
  Array<int> start(context_);
  launch(context_, "tiles", find_tiles<false>, blocks, kThreads, view_, tiles_, nullptr, count.data(), nullptr,
         nullptr);
  const auto entries = static_cast<std::size_t>(add_up(context_, count, start));
  Array<int> tile(context_, entries);
  Array<int> place(context_, entries);
  Array<int> sorted(context_);
  launch(context_, "tiles", find_tiles<true>, blocks, kThreads, view_, tiles_, start.data(), nullptr, tile.data(),
         place.data());
  sort_pairs(context_, tiles, tile, place, sorted, tile_face_);
  find_starts(context_, sorted, tiles, tile_start_);
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
