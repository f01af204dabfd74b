#include <cub/device/device_radix_sort.cuh>
#include <cub/device/device_scan.cuh>
#include <thrust/binary_search.h>
#include <thrust/execution_policy.h>
#include <thrust/iterator/counting_iterator.h>

#include "sim/gpu/cuda/launch.cuh"
#include "sim/gpu/cuda/lists.cuh"

namespace touchfield::cuda {

template <typename Key>
void sort_pairs(Context& context, Key most, const Array<Key>& key, const Array<int>& value, Array<Key>& sorted,
                Array<int>& moved) {
  const auto count = static_cast<int>(key.size());
  sorted.resize(key.size());
  moved.resize(key.size());
  int bits = 1;
  while (bits < 8 * static_cast<int>(sizeof(Key)) - 1 && most >> bits > 0) {
    ++bits;
  }
  with_room(context, "sort", [&](void* room, std::size_t& bytes) {
    return cub::DeviceRadixSort::SortPairs(room, bytes, key.data(), sorted.data(), value.data(), moved.data(), count, 0,
                                           bits, context.stream());
  });
}
template void sort_pairs(Context&, int, const Array<int>&, const Array<int>&, Array<int>&, Array<int>&);
template void sort_pairs(Context&, std::int64_t, const Array<std::int64_t>&, const Array<int>&, Array<std::int64_t>&,
                         Array<int>&);

void find_starts(Context& context, const Array<int>& sorted, int count, Array<int>& start) {
  const thrust::counting_iterator<int> numbers(0);
  start.resize(static_cast<std::size_t>(count) + 1);
  thrust::lower_bound(thrust::cuda::par.on(context.stream()), sorted.data(), sorted.data() + sorted.size(), numbers,
                      numbers + count + 1, start.data());
}

int add_up(Context& context, const Array<int>& count, Array<int>& start) {
  start.resize(count.size());
  with_room(context, "lists", [&](void* room, std::size_t& bytes) {
    return cub::DeviceScan::ExclusiveSum(room, bytes, count.data(), start.data(), static_cast<int>(count.size()),
                                         context.stream());
  });
  return start.value(count.size() - 1);
}

}  // namespace touchfield::cuda
