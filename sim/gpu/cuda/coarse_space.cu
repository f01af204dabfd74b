#include <climits>
#include <stdexcept>

#include "sim/bem/coarse_formulas.h"
#include "sim/gpu/cuda/coarse_space.cuh"
#include "sim/gpu/cuda/launch.cuh"
#include "sim/gpu/cuda/lists.cuh"

namespace touchfield::cuda {

namespace {

constexpr int kThreads = 128;
constexpr int kSpreadThreads = 1024;
constexpr int kSpreadWarps = kSpreadThreads / kWarp;
constexpr int kNear = kCoarseNeighbours;

/// A face in (x, s n) [m].
struct Place {
  float x[6];
};

__device__ Place place_of(const FaceView& faces, double scale, int f) {
  const Vector at = faces.centroid[f];
  const Vector n = scale * faces.normal[f];
  return {{static_cast<float>(at.x), static_cast<float>(at.y), static_cast<float>(at.z), static_cast<float>(n.x),
           static_cast<float>(n.y), static_cast<float>(n.z)}};
}

__device__ float squared_distance(const Place& a, const Place& b) {
  float sum = 0.0F;
#pragma unroll
  for (int i = 0; i < 6; ++i) {
    sum += (a.x[i] - b.x[i]) * (a.x[i] - b.x[i]);
  }
  return sum;
}

/// Face after face becomes a point where none is nearer than the spacing; one block, so many faces at a time.
__global__ void __launch_bounds__(kSpreadThreads)
    spread_points(FaceView faces, double scale, float spacing2, int most, int* points, Place* places, int* count) {
  __shared__ int first_open[kSpreadWarps];
  __shared__ Place tile[kSpreadThreads];
  const int thread = static_cast<int>(threadIdx.x);
  int total = 0;
  for (int begin = 0; begin < faces.count && total < most; begin += kSpreadThreads) {
    const int f = begin + thread;
    const Place own = place_of(faces, scale, min(f, faces.count - 1));
    bool open = f < faces.count;
    for (int from = 0; from < total; from += kSpreadThreads) {
      const int taken = min(kSpreadThreads, total - from);
      __syncthreads();
      if (thread < taken) {
        tile[thread] = places[from + thread];
      }
      __syncthreads();
#pragma unroll 4
      for (int p = 0; p < taken; ++p) {
        open = open && squared_distance(own, tile[p]) >= spacing2;
      }
    }
    while (total < most) {
      const unsigned of_warp = __ballot_sync(kAllLanes, open);
      if (thread % kWarp == 0) {
        first_open[thread / kWarp] = of_warp != 0 ? f + __ffs(static_cast<int>(of_warp)) - 1 : INT_MAX;
      }
      __syncthreads();
      int first = INT_MAX;
      for (const int of_one : first_open) {
        first = min(first, of_one);
      }
      __syncthreads();
      if (first == INT_MAX) {
        break;
      }
      if (f == first) {
        points[total] = f;
        places[total] = own;
      }
      open = open && squared_distance(own, place_of(faces, scale, first)) >= spacing2;
      ++total;
    }
    __syncthreads();
  }
  if (thread == 0) {
    *count = total;
  }
}

/// Weights C^-1 c by Cholesky's factors of C, in place of c.
__device__ void solve_covariance(double (&c)[kNear][kNear], double (&right)[kNear]) {
  for (int j = 0; j < kNear; ++j) {
    for (int i = j; i < kNear; ++i) {
      double sum = c[i][j];
      for (int k = 0; k < j; ++k) {
        sum -= c[i][k] * c[j][k];
      }
      c[i][j] = i == j ? sqrt(sum) : sum / c[j][j];
    }
  }
  for (int i = 0; i < kNear; ++i) {
    for (int k = 0; k < i; ++k) {
      right[i] -= c[i][k] * right[k];
    }
    right[i] /= c[i][i];
  }
  for (int i = kNear - 1; i >= 0; --i) {
    for (int k = i + 1; k < kNear; ++k) {
      right[i] -= c[k][i] * right[k];
    }
    right[i] /= c[i][i];
  }
}

/// A thread a face: its nearest points, and their weights.
__global__ void __launch_bounds__(kThreads) interpolate_faces(FaceView faces, double scale, double shortest, int size,
                                                              const Place* places, int* point, float* weight) {
  __shared__ Place tile[kThreads];
  const int thread = static_cast<int>(threadIdx.x);
  const int f = static_cast<int>(blockIdx.x) * kThreads + thread;
  const Place own = place_of(faces, scale, min(f, faces.count - 1));
  float distance[kNear];
  int nearest[kNear];
#pragma unroll
  for (int a = 0; a < kNear; ++a) {
    distance[a] = INFINITY;
    nearest[a] = 0;
  }
  for (int begin = 0; begin < size; begin += kThreads) {
    __syncthreads();
    if (begin + thread < size) {
      tile[thread] = places[begin + thread];
    }
    __syncthreads();
    for (int t = 0; t < min(kThreads, size - begin); ++t) {
      float d = squared_distance(own, tile[t]);
      int p = begin + t;
      if (d < distance[kNear - 1]) {
#pragma unroll
        for (int a = 0; a < kNear; ++a) {
          if (d < distance[a]) {
            const float other = distance[a];
            const int number = nearest[a];
            distance[a] = d;
            nearest[a] = p;
            d = other;
            p = number;
          }
        }
      }
    }
  }
  if (f >= faces.count) {
    return;
  }
  double c[kNear][kNear];
  double right[kNear];
  for (int a = 0; a < kNear; ++a) {
    right[a] = coarse_covariance(shortest * sqrt(static_cast<double>(distance[a])));
    c[a][a] = 1.0 + kCoarseNugget;
    for (int b = 0; b < a; ++b) {
      const double apart = squared_distance(places[nearest[a]], places[nearest[b]]);
      c[a][b] = coarse_covariance(shortest * sqrt(apart));
    }
  }
  solve_covariance(c, right);
  for (int a = 0; a < kNear; ++a) {
    point[std::size_t{1} * f * kNear + a] = nearest[a];
    weight[std::size_t{1} * f * kNear + a] = static_cast<float>(right[a]);
  }
}

__global__ void set_numbers(int count, int* number) {
  const int i = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  if (i < count) {
    number[i] = i;
  }
}

/// A warp a point and column.
__global__ void gather_values(int faces, int size, const int* start, const int* entry, const float* weight,
                              const double* area, const cuComplex* v, cuComplex* c) {
  const int lane = static_cast<int>(threadIdx.x) % kWarp;
  const int p = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x) / kWarp;
  if (p >= size) {
    return;
  }
  double re = 0.0;
  double im = 0.0;
  for (int q = start[p] + lane; q < start[p + 1]; q += kWarp) {
    const int f = entry[q] / kNear;
    const double w = weight[entry[q]] * (area != nullptr ? area[f] : 1.0);
    const cuComplex value = v[std::size_t{blockIdx.y} * faces + f];
    re += w * value.x;
    im += w * value.y;
  }
  re = lane_sum<kWarp>(re);
  im = lane_sum<kWarp>(im);
  if (lane == 0) {
    c[std::size_t{blockIdx.y} * size + p] = {static_cast<float>(re), static_cast<float>(im)};
  }
}

__global__ void add_values(int faces, int size, const int* point, const float* weight, const double* area, float factor,
                           const cuComplex* c, const cuComplex* from, cuComplex* y) {
  const int f = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  if (f >= faces) {
    return;
  }
  cuComplex sum = {0.0F, 0.0F};
  for (int a = 0; a < kNear; ++a) {
    const std::size_t at = std::size_t{1} * f * kNear + a;
    sum = cuCaddf(sum, scaled(c[std::size_t{blockIdx.y} * size + point[at]], weight[at]));
  }
  const std::size_t i = std::size_t{blockIdx.y} * faces + f;
  y[i] = cuCaddf(from[i], scaled(sum, factor * (area != nullptr ? area[f] : 1.0)));
}

/// A column of P^T A P, that of a point; a warp adds its faces one after the other, a lane an entry.
__global__ void fill_mass_column(int size, const int* start, const int* entry, const int* point, const float* weight,
                                 const double* area, cuComplex* matrix) {
  const auto p = static_cast<int>(blockIdx.x);
  const auto lane = static_cast<int>(threadIdx.x);
  cuComplex* column = matrix + std::size_t{1} * p * size;
  for (int q = start[p]; q < start[p + 1]; ++q) {
    const int f = entry[q] / kNear;
    if (lane < kNear) {
      const std::size_t at = std::size_t{1} * f * kNear + lane;
      column[point[at]].x += static_cast<float>(area[f] * weight[entry[q]] * weight[at]);
    }
    __syncwarp();
  }
}

/// A thread a row, a block row of them a point.
__global__ void multiply_panel(int first, int rows, int size, const int* start, const int* entry, const float* weight,
                               const cuComplex* panel, int ld, cuComplex* matrix) {
  const int row = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  const auto p = static_cast<int>(blockIdx.y);
  if (row >= rows) {
    return;
  }
  cuComplex sum = {0.0F, 0.0F};
#pragma unroll 4
  for (int q = start[p]; q < start[p + 1]; ++q) {
    sum = cuCaddf(sum, scaled(panel[row + std::size_t{1} * (entry[q] / kNear) * ld], weight[entry[q]]));
  }
  matrix[first + row + std::size_t{1} * p * size] = sum;
}

}  // namespace

CoarseSpace::CoarseSpace(const Faces& faces, int most) : faces_(faces), context_(faces.context()) {
  const double wavelength = 2.0 * kPi / faces.wave().k;
  const double scale = kCoarseNormalScale * wavelength;
  const auto spacing = static_cast<float>(kCoarseSpacing * wavelength);
  const auto count = static_cast<std::size_t>(faces.size());
  points_.resize(static_cast<std::size_t>(most) + 1);
  Array<Place> places(context_, points_.size());
  Array<int> found(context_, 1);
  launch(context_, "points", spread_points, 1, kSpreadThreads, faces.view(), scale, spacing * spacing, most + 1,
         points_.data(), places.data(), found.data());
  size_ = found.value(0);
  if (size_ > most || size_ < kNear) {
    throw std::domain_error("a coarse space of too many points, or too few");
  }
  point_.resize(count * kNear);
  weight_.resize(count * kNear);
  launch(context_, "interpolation", interpolate_faces, blocks_for(count, kThreads), kThreads, faces.view(), scale,
         kCoarseShortest * faces.wave().k, size_, places.data(), point_.data(), weight_.data());
  Array<int> number(context_, point_.size());
  Array<int> sorted(context_);
  launch(context_, "interpolation", set_numbers, blocks_for(number.size(), kThreads), kThreads,
         static_cast<int>(number.size()), number.data());
  sort_pairs(context_, size_, point_, number, sorted, entry_);
  find_starts(context_, sorted, size_, start_);
}

void CoarseSpace::gather(bool by_areas, const cuComplex* v, int columns, cuComplex* c) const {
  launch(context_, "to points", gather_values, dim3(blocks_for(std::size_t{kWarp} * size_, kThreads), columns),
         kThreads, faces_.size(), size_, start_.data(), entry_.data(), weight_.data(),
         by_areas ? faces_.view().area : nullptr, v, c);
}

void CoarseSpace::add_interpolated(bool by_areas, float factor, const cuComplex* c, int columns, const cuComplex* from,
                                   cuComplex* y) const {
  launch(context_, "from points", add_values, dim3(blocks_for(faces_.size(), kThreads), columns), kThreads,
         faces_.size(), size_, point_.data(), weight_.data(), by_areas ? faces_.view().area : nullptr, factor, c, from,
         y);
}

void CoarseSpace::fill_mass(cuComplex* matrix) const {
  check(cudaMemsetAsync(matrix, 0, sizeof(cuComplex) * size_ * size_, context_.stream()), "mass of points");
  launch(context_, "mass of points", fill_mass_column, size_, kWarp, size_, start_.data(), entry_.data(), point_.data(),
         weight_.data(), faces_.view().area, matrix);
}

void CoarseSpace::multiply_rows(int first, int rows, const cuComplex* panel, int ld, cuComplex* matrix) const {
  launch(context_, "rows of points", multiply_panel, dim3(blocks_for(rows, kThreads), size_), kThreads, first, rows,
         size_, start_.data(), entry_.data(), weight_.data(), panel, ld, matrix);
}

}  // namespace touchfield::cuda
