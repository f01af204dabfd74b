#include <algorithm>
#include <cub/device/device_radix_sort.cuh>
#include <cub/device/device_scan.cuh>
#include <cub/device/device_select.cuh>
#include <thrust/binary_search.h>
#include <thrust/copy.h>
#include <thrust/execution_policy.h>
#include <thrust/iterator/counting_iterator.h>

#include "sim/gpu/cuda/boundary.cuh"
#include "sim/gpu/cuda/launch.cuh"

namespace touchfield::cuda {

namespace {

constexpr int kThreads = 128;
constexpr int kRows = 4;      // that a warp searches at once: a face that is read meets four
constexpr int kQuarters = 4;  // of a split face, a thread each

/// The near faces of each row, ascending: how many, or with kFill the pairs from start[i] on. A warp searches kRows.
template <bool kFill>
__global__ void search_near(FaceView faces, double reach2, const int* start, int* count, int* row, int* column) {
  const int lane = static_cast<int>(threadIdx.x) % kWarp;
  const int first = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x) / kWarp * kRows;
  if (first >= faces.count) {  // the whole warp
    return;
  }
  const unsigned before = (1U << static_cast<unsigned>(lane)) - 1U;
  Vector x[kRows];
  int found[kRows] = {};
  for (int r = 0; r < kRows; ++r) {
    const int i = min(first + r, faces.count - 1);
    x[r] = faces.centroid[i];
    if (kFill) {
      found[r] = start[i];
    }
  }
  for (int begin = 0; begin < faces.count; begin += kWarp) {
    const int j = begin + lane;
    const int read = min(j, faces.count - 1);
    const Vector y = faces.centroid[read];
    const double limit = j < faces.count ? rounded_product(reach2, faces.area[read]) : 0.0;
#pragma unroll
    for (int r = 0; r < kRows; ++r) {
      const int i = first + r;
      const bool near = i < faces.count && i != j && squared_norm(x[r] - y) < limit;
      const unsigned hits = __ballot_sync(kAllLanes, near);
      if (hits == 0) {
        continue;
      }
      if (kFill && near) {
        const int at = found[r] + __popc(hits & before);
        row[at] = i;
        column[at] = j;
      }
      found[r] += __popc(hits);
    }
  }
  if (!kFill && lane == 0) {
    for (int r = 0; r < kRows && first + r < faces.count; ++r) {
      count[first + r] = found[r];
    }
  }
}

__device__ FaceKind kind_of(const FaceView& faces, const NearRule& rule, int i, int j) {
  return face_kind(rule, squared_norm(faces.centroid[i] - faces.centroid[j]), faces.area[j]);
}

/// Whether the face of a pair is split.
struct IsSplit {
  FaceView faces;
  NearRule rule;
  const int *row, *column;

  __device__ bool operator()(int p) const { return kind_of(faces, rule, row[p], column[p]) == FaceKind::kSplit; }
};

/// A pair's integral less its one point as the sums make it.
template <bool kDamped>
__device__ cuComplex less_one_point(const FaceView& faces, const SurfaceWave& wave, const FaceSum<kDamped>& sum, int i,
                                    int j) {
  float re;
  float im;
  pair_kernel<Layer::kBurtonMiller, kDamped>(wave.constants<float>(),
                                             pair_distance<float>(faces.place[i] - faces.place[j]),
                                             faces.plain_normal[i], faces.plain_normal[j], re, im);
  const double weight = faces.weight[j];
  return {static_cast<float>(sum.re - weight * re), static_cast<float>(sum.im - weight * im)};
}

/// A thread a pair whose face is not split.
template <bool kDamped>
__global__ void __launch_bounds__(kThreads) integrate_whole(FaceView faces, SurfaceWave wave, NearRule rule, int pairs,
                                                            const int* row, const int* column, cuComplex* value) {
  const int p = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  if (p >= pairs) {
    return;
  }
  const int i = row[p];
  const int j = column[p];
  const FaceKind kind = kind_of(faces, rule, i, j);
  if (kind == FaceKind::kSplit) {
    return;
  }
  FaceSum<kDamped> sum(wave, faces.centroid[i], faces.normal[i]);
  const Triangle face = faces.face(j);
  if (kind == FaceKind::kSevenPoints) {
    sum.add_exact_static(face);
    sum.add_seven(face);
  } else if (kind == FaceKind::kThreePoints) {
    sum.add_three(face);
  } else {
    sum.template add_point<false>(faces.centroid[j], face.normal, face.area);
  }
  value[p] = less_one_point(faces, wave, sum, i, j);
}

/// Four threads a pair whose face is split, a quarter each.
template <bool kDamped>
__global__ void __launch_bounds__(kThreads)
    integrate_split(FaceView faces, SurfaceWave wave, double split2, int splits, const int* split, const int* row,
                    const int* column, cuComplex* value) {
  const int thread = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  const int p = split[min(thread / kQuarters, splits - 1)];  // all threads take part in the exchange
  const int i = row[p];
  const int j = column[p];
  FaceSum<kDamped> sum(wave, faces.centroid[i], faces.normal[i]);
  const Triangle face = faces.face(j);
  sum.add_quarter(face, split2, static_cast<unsigned>(thread % kQuarters));
  __syncwarp();
  sum.re = lane_sum<kQuarters>(sum.re);
  sum.im = lane_sum<kQuarters>(sum.im);
  if (thread / kQuarters < splits && thread % kQuarters == 0) {
    sum.add_exact_static(face);
    value[p] = less_one_point(faces, wave, sum, i, j);
  }
}

/// A warp a row and column of x. order: null, or the number of each pair.
__global__ void subtract_sparse(int size, const int* start, const int* order, const int* index, const cuComplex* value,
                                const cuComplex* x, cuComplex* y) {
  const int lane = static_cast<int>(threadIdx.x) % kWarp;
  const int i = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x) / kWarp;
  if (i >= size) {
    return;
  }
  const std::size_t column = std::size_t{1} * blockIdx.y * size;
  double re = 0.0;
  double im = 0.0;
  for (int q = start[i] + lane; q < start[i + 1]; q += kWarp) {
    const int p = order != nullptr ? order[q] : q;
    const cuComplex n = value[p];
    const cuComplex v = x[column + index[p]];
    re += static_cast<double>(n.x) * v.x - static_cast<double>(n.y) * v.y;
    im += static_cast<double>(n.x) * v.y + static_cast<double>(n.y) * v.x;
  }
  re = lane_sum<kWarp>(re);
  im = lane_sum<kWarp>(im);
  if (lane == 0) {
    cuComplex& out = y[column + i];
    out = {static_cast<float>(out.x - re), static_cast<float>(out.y - im)};
  }
}

/// A warp a row.
__global__ void subtract_from_panel(RowRange rows, const int* start, const int* column, const cuComplex* value,
                                    cuComplex* panel, int ld) {
  const int lane = static_cast<int>(threadIdx.x) % kWarp;
  const int row = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x) / kWarp;
  if (row >= rows.count) {
    return;
  }
  const int i = rows.face(row);
  for (int q = start[i] + lane; q < start[i + 1]; q += kWarp) {
    cuComplex& out = panel[row + std::size_t{1} * column[q] * ld];
    out = {out.x - value[q].x, out.y - value[q].y};
  }
}

unsigned warp_blocks(int count) { return blocks_for(std::size_t{1} * count * kWarp, kThreads); }

}  // namespace

NearCorrections::NearCorrections(const Faces& faces, const NearRule& rule)
    : faces_(faces), context_(faces.context()), rule_(rule) {
  update();
}

void NearCorrections::update() {
  const int size = faces_.size();
  const unsigned blocks = warp_blocks((size + kRows - 1) / kRows);
  const double reach = std::max(rule_.seven_below, rule_.three_below);
  is_sorted_ = false;
  count_.resize(size + 1);
  count_.set_zero();
  start_.resize(size + 1);
  launch(context_, "near faces", search_near<false>, blocks, kThreads, faces_.view(), reach * reach, nullptr,
         count_.data(), nullptr, nullptr);
  with_room(context_, "near faces", [&](void* room, std::size_t& bytes) {
    return cub::DeviceScan::ExclusiveSum(room, bytes, count_.data(), start_.data(), size + 1, context_.stream());
  });
  const int pairs = start_.value(size);
  for (Array<int>* values : {&row_, &column_, &order_}) {
    values->resize(pairs);
  }
  value_.resize(pairs);
  if (pairs > 0) {
    launch(context_, "near faces", search_near<true>, blocks, kThreads, faces_.view(), reach * reach, start_.data(),
           nullptr, row_.data(), column_.data());
    integrate();
  }
}

void NearCorrections::integrate() {
  const FaceView& faces = faces_.view();
  const SurfaceWave& wave = faces_.wave();
  const bool damped = wave.alpha != 0.0;
  with_room(context_, "near faces", [&](void* room, std::size_t& bytes) {
    return cub::DeviceSelect::If(room, bytes, thrust::counting_iterator<int>(0), order_.data(), count_.data(), pairs(),
                                 IsSplit{faces, rule_, row_.data(), column_.data()}, context_.stream());
  });
  const int splits = count_.value(0);
  launch(context_, "near integrals", damped ? integrate_whole<true> : integrate_whole<false>,
         blocks_for(pairs(), kThreads), kThreads, faces, wave, rule_, pairs(), row_.data(), column_.data(),
         value_.data());
  launch(context_, "near integrals", damped ? integrate_split<true> : integrate_split<false>,
         blocks_for(std::size_t{kQuarters} * splits, kThreads), kThreads, faces, wave, rule_.split2(), splits,
         order_.data(), row_.data(), column_.data(), value_.data());
}

void NearCorrections::sort_by_columns() {
  if (is_sorted_) {
    return;
  }
  const auto there = thrust::cuda::par.on(context_.stream());
  const thrust::counting_iterator<int> count(0);
  Array<int> number(context_, pairs());
  Array<int> column(context_, pairs());
  thrust::copy(there, count, count + pairs(), number.data());
  with_room(context_, "near faces", [&](void* room, std::size_t& bytes) {
    return cub::DeviceRadixSort::SortPairs(room, bytes, column_.data(), column.data(), number.data(), order_.data(),
                                           pairs(), 0, 8 * sizeof(int), context_.stream());
  });
  column_start_.resize(faces_.size() + 1);
  thrust::lower_bound(there, column.data(), column.data() + pairs(), count, count + faces_.size() + 1,
                      column_start_.data());
  is_sorted_ = true;
}

void NearCorrections::subtract_product(bool transposed, const cuComplex* x, cuComplex* y, int columns) {
  if (transposed) {
    sort_by_columns();
  }
  launch(context_, "near product", subtract_sparse, dim3(warp_blocks(faces_.size()), columns), kThreads, faces_.size(),
         transposed ? column_start_.data() : start_.data(), transposed ? order_.data() : nullptr,
         transposed ? row_.data() : column_.data(), value_.data(), x, y);
}

void NearCorrections::subtract_rows(const RowRange& rows, cuComplex* panel, int ld) const {
  launch(context_, "near rows", subtract_from_panel, warp_blocks(rows.count), kThreads, rows, start_.data(),
         column_.data(), value_.data(), panel, ld);
}

}  // namespace touchfield::cuda
