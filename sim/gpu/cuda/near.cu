#include <cub/device/device_scan.cuh>
#include <stdexcept>

#include "sim/gpu/cuda/near.cuh"

namespace touchfield::cuda {

namespace {

constexpr unsigned kThreads = 128;
constexpr unsigned kWarp = 32;
constexpr unsigned kAll = 0xffffffffU;
constexpr int kRows = 4;      // that a warp searches at once: a face that is read meets four
constexpr int kQuarters = 4;  // of a split face, a thread each

/// What search_near writes: counts in its first pass, pairs in its second.
struct NearOutput {
  int *count, *split_count;        // first pass
  const int *start, *split_start;  // second pass
  int *row, *column, *split;
};

/// The near faces of each row, ascending; kTransposed: the rows near to which each face is. A warp searches kRows.
template <bool kFill, bool kTransposed>
__global__ void search_near(FaceView faces, NearRule rule, NearOutput out) {
  const int lane = static_cast<int>(threadIdx.x % kWarp);
  const int first = static_cast<int>((blockIdx.x * blockDim.x + threadIdx.x) / kWarp) * kRows;
  if (first >= faces.count) {  // the whole warp
    return;
  }
  const double reach2 = rounded_product(rule.reach(), rule.reach());
  const unsigned before = (1U << static_cast<unsigned>(lane)) - 1U;
  Vector x[kRows];
  double own_area[kRows];
  int found[kRows] = {};
  int split[kRows] = {};
  for (int r = 0; r < kRows; ++r) {
    const int i = min(first + r, faces.count - 1);
    x[r] = faces.centroid[i];
    own_area[r] = faces.area[i];
    if (kFill && first + r < faces.count) {
      found[r] = out.start[i];
      split[r] = kTransposed ? 0 : out.split_start[i];
    }
  }
  for (int begin = 0; begin < faces.count; begin += static_cast<int>(kWarp)) {
    const int j = begin + lane;
    const int read = min(j, faces.count - 1);
    const Vector y = faces.centroid[read];
    const double area = faces.area[read];
#pragma unroll
    for (int r = 0; r < kRows; ++r) {
      const int i = first + r;
      const double distance2 = squared_norm(x[r] - y);
      const double of_face = kTransposed ? own_area[r] : area;
      const bool near = i < faces.count && j < faces.count && i != j && distance2 < rounded_product(reach2, of_face);
      const unsigned hits = __ballot_sync(kAll, near);
      if (hits == 0) {
        continue;
      }
      unsigned split_hits = 0;
      if (!kTransposed) {
        const bool is_cut = near && face_kind(rule, distance2, of_face) == FaceKind::kSplit;
        split_hits = __ballot_sync(kAll, is_cut);
        if (kFill && is_cut) {
          out.split[split[r] + __popc(split_hits & before)] = found[r] + __popc(hits & before);
        }
      }
      if (kFill && near) {
        const int at = found[r] + __popc(hits & before);
        out.column[at] = j;
        if (!kTransposed) {
          out.row[at] = i;
        }
      }
      found[r] += __popc(hits);
      split[r] += __popc(split_hits);
    }
  }
  if (!kFill && lane == 0) {
    for (int r = 0; r < kRows && first + r < faces.count; ++r) {
      out.count[first + r] = found[r];
      if (!kTransposed) {
        out.split_count[first + r] = split[r];
      }
    }
  }
}

/// The surface as the sums over one point a face see it.
struct OnePoints {
  Differences differences;
  PairView<Vector> precise;
  PairView<float3> single;
};

/// A pair's integral less its one point as the sums make it.
template <Layer kLayer, bool kDamped>
__device__ cuComplex less_one_point(const OnePoints& points, const SurfaceWave& wave,
                                    const FaceSum<kLayer, kDamped>& sum, int i, int j) {
  const PairDistance<float> d = points.differences == Differences::kDouble
                                    ? distance_between(points.precise.place[i], points.precise.place[j])
                                    : distance_between(points.single.place[i], points.single.place[j]);
  const float3 m = points.single.normal[i];
  const float3 n = points.single.normal[j];
  float re;
  float im;
  pair_kernel<kLayer, kDamped>(wave.constants<float>(), d, m.x, m.y, m.z, n.x, n.y, n.z, re, im);
  const double weight = points.single.weight[j];
  return {static_cast<float>(sum.re - weight * re), static_cast<float>(sum.im - weight * im)};
}

/// A thread a pair whose face is not split.
template <Layer kLayer, bool kDamped>
__global__ void __launch_bounds__(kThreads)
    integrate_whole(FaceView faces, OnePoints points, SurfaceWave wave, NearRule rule, int pairs, const int* row,
                    const int* column, cuComplex* value) {
  const int p = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  if (p >= pairs) {
    return;
  }
  const int i = row[p];
  const int j = column[p];
  const Vector x = faces.centroid[i];
  const FaceKind kind = face_kind(rule, squared_norm(x - faces.centroid[j]), faces.area[j]);
  if (kind == FaceKind::kSplit) {
    return;
  }
  FaceSum<kLayer, kDamped> sum(wave, x, faces.normal[i]);
  const Triangle face = faces.face(j);
  if (kind == FaceKind::kSevenPoints) {
    sum.add_exact_static(face);
    sum.add_seven(face.a, face.b, face.c, face.normal, face.area);
  } else if (kind == FaceKind::kThreePoints) {
    sum.add_three(face);
  } else {
    sum.template add_point<false>(faces.centroid[j], face.normal, face.area);
  }
  value[p] = less_one_point(points, wave, sum, i, j);
}

/// Four threads a pair whose face is split, a quarter each.
template <Layer kLayer, bool kDamped>
__global__ void __launch_bounds__(kThreads)
    integrate_split(FaceView faces, OnePoints points, SurfaceWave wave, NearRule rule, int splits, const int* split,
                    const int* row, const int* column, cuComplex* value) {
  const int thread = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  const int quarter = thread % kQuarters;
  const int s = min(thread / kQuarters, splits - 1);  // all threads take part in the exchange
  const int p = split[s];
  const int i = row[p];
  const int j = column[p];
  FaceSum<kLayer, kDamped> sum(wave, faces.centroid[i], faces.normal[i]);
  const Triangle face = faces.face(j);
  if (thread / kQuarters < splits) {
    sum.add_pieces(face, rule.split_ratio, quarter);
  }
  __syncwarp();
  for (int apart = 1; apart < kQuarters; apart *= 2) {
    sum.re += __shfl_xor_sync(kAll, sum.re, apart);
    sum.im += __shfl_xor_sync(kAll, sum.im, apart);
  }
  if (thread / kQuarters < splits && quarter == 0) {
    sum.add_exact_static(face);
    value[p] = less_one_point(points, wave, sum, i, j);
  }
}

/// The number of each pair of the transposed pattern; a warp a column.
__global__ void find_pairs(int size, const int* start, const int* column, const int* transposed_start,
                           const int* transposed_row, int* transposed_pair) {
  const int lane = static_cast<int>(threadIdx.x % kWarp);
  const int j = static_cast<int>((blockIdx.x * blockDim.x + threadIdx.x) / kWarp);
  if (j >= size) {
    return;
  }
  for (int q = transposed_start[j] + lane; q < transposed_start[j + 1]; q += static_cast<int>(kWarp)) {
    const int i = transposed_row[q];
    int low = start[i];
    int high = start[i + 1] - 1;
    while (low < high) {
      const int middle = low + (high - low) / 2;
      if (column[middle] < j) {
        low = middle + 1;
      } else {
        high = middle;
      }
    }
    transposed_pair[q] = low;
  }
}

/// Blocks that hold a warp for each of `count`.
unsigned warp_blocks(int count) { return blocks_for(static_cast<std::size_t>(count) * kWarp, kThreads); }

}  // namespace

NearCorrections::NearCorrections(const Faces& faces, Layer layer, const NearRule& rule, Differences differences)
    : faces_(faces),
      layer_(layer),
      rule_(rule),
      differences_(differences),
      count_(faces.context()),
      split_count_(faces.context()),
      start_(faces.context()),
      split_start_(faces.context()),
      row_(faces.context()),
      column_(faces.context()),
      split_(faces.context()),
      value_(faces.context()),
      transposed_start_(faces.context()),
      transposed_row_(faces.context()),
      transposed_pair_(faces.context()),
      scratch_(faces.context()) {
  if (layer != Layer::kDouble && layer != Layer::kBurtonMiller) {
    throw std::invalid_argument("NearCorrections: this layer is not made");
  }
  update();
}

void NearCorrections::scan(const Array<int>& counts, Array<int>& starts) {
  const auto stream = faces_.context().stream();
  const int size = static_cast<int>(counts.size());
  starts.resize(counts.size());
  std::size_t bytes = 0;
  check(cub::DeviceScan::ExclusiveSum(nullptr, bytes, counts.data(), starts.data(), size, stream), "begins of rows");
  scratch_.resize(bytes);
  check(cub::DeviceScan::ExclusiveSum(scratch_.data(), bytes, counts.data(), starts.data(), size, stream),
        "begins of rows");
}

void NearCorrections::update() {
  Context& context = faces_.context();
  const int size = faces_.size();
  const auto stream = context.stream();
  const unsigned search_blocks = warp_blocks((size + kRows - 1) / kRows);
  has_transposed_ = false;
  for (Array<int>* counts : {&count_, &split_count_}) {
    counts->resize(static_cast<std::size_t>(size) + 1);
    counts->set_zero();
  }
  search_near<false, false><<<search_blocks, kThreads, 0, stream>>>(
      faces_.view(), rule_, {count_.data(), split_count_.data(), nullptr, nullptr, nullptr, nullptr, nullptr});
  context.launched("near faces");
  scan(count_, start_);
  scan(split_count_, split_start_);
  auto* totals = static_cast<int*>(context.staging(2 * sizeof(int)));
  check(cudaMemcpyAsync(totals, start_.data() + size, sizeof(int), cudaMemcpyDeviceToHost, stream), "near faces");
  check(cudaMemcpyAsync(totals + 1, split_start_.data() + size, sizeof(int), cudaMemcpyDeviceToHost, stream),
        "near faces");
  context.synchronize();
  pairs_ = totals[0];
  splits_ = totals[1];
  const auto pairs = static_cast<std::size_t>(pairs_);
  row_.resize(pairs);
  column_.resize(pairs);
  value_.resize(pairs);
  split_.resize(static_cast<std::size_t>(splits_));
  if (pairs_ == 0) {
    return;
  }
  search_near<true, false><<<search_blocks, kThreads, 0, stream>>>(
      faces_.view(), rule_,
      {nullptr, nullptr, start_.data(), split_start_.data(), row_.data(), column_.data(), split_.data()});
  context.launched("near faces");
  if (faces_.wave().alpha != 0.0) {
    compute_values<true>();
  } else {
    compute_values<false>();
  }
}

template <bool kDamped>
void NearCorrections::compute_values() {
  if (layer_ == Layer::kDouble) {
    launch_values<Layer::kDouble, kDamped>();
  } else {
    launch_values<Layer::kBurtonMiller, kDamped>();
  }
}

template <Layer kLayer, bool kDamped>
void NearCorrections::launch_values() {
  Context& context = faces_.context();
  const OnePoints points{differences_, faces_.pairs<Vector>(), faces_.pairs<float3>()};
  integrate_whole<kLayer, kDamped>
      <<<blocks_for(static_cast<std::size_t>(pairs_), kThreads), kThreads, 0, context.stream()>>>(
          faces_.view(), points, faces_.wave(), rule_, pairs_, row_.data(), column_.data(), value_.data());
  context.launched("near integrals");
  if (splits_ > 0) {
    integrate_split<kLayer, kDamped>
        <<<blocks_for(static_cast<std::size_t>(splits_) * kQuarters, kThreads), kThreads, 0, context.stream()>>>(
            faces_.view(), points, faces_.wave(), rule_, splits_, split_.data(), row_.data(), column_.data(),
            value_.data());
    context.launched("near integrals");
  }
}

void NearCorrections::make_transposed() {
  if (has_transposed_) {
    return;
  }
  Context& context = faces_.context();
  const int size = faces_.size();
  const unsigned search_blocks = warp_blocks((size + kRows - 1) / kRows);
  count_.set_zero();
  search_near<false, true><<<search_blocks, kThreads, 0, context.stream()>>>(
      faces_.view(), rule_, {count_.data(), nullptr, nullptr, nullptr, nullptr, nullptr, nullptr});
  context.launched("near faces by columns");
  scan(count_, transposed_start_);
  transposed_row_.resize(static_cast<std::size_t>(pairs_));
  transposed_pair_.resize(static_cast<std::size_t>(pairs_));
  if (pairs_ > 0) {
    search_near<true, true><<<search_blocks, kThreads, 0, context.stream()>>>(
        faces_.view(), rule_,
        {nullptr, nullptr, transposed_start_.data(), nullptr, nullptr, transposed_row_.data(), nullptr});
    context.launched("near faces by columns");
    find_pairs<<<warp_blocks(size), kThreads, 0, context.stream()>>>(
        size, start_.data(), column_.data(), transposed_start_.data(), transposed_row_.data(), transposed_pair_.data());
    context.launched("near faces by columns");
  }
  has_transposed_ = true;
}

}  // namespace touchfield::cuda
