#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace touchfield {

/// The median of the last kRemembered numbers; of an even number the lower one of the two in the middle, 0 of none.
class RunningMedian {
 public:
  static constexpr std::size_t kRemembered = 31;

  RunningMedian() { last_.reserve(kRemembered); }

  void add(std::int64_t value) {
    if (last_.size() < kRemembered) {
      last_.push_back(value);
    } else {
      last_[oldest_] = value;
      oldest_ = (oldest_ + 1) % kRemembered;
    }
  }

  std::int64_t value() const {
    if (last_.empty()) {
      return 0;
    }
    std::vector<std::int64_t> sorted = last_;
    const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>((sorted.size() - 1) / 2);
    std::ranges::nth_element(sorted, middle);
    return *middle;
  }

 private:
  std::vector<std::int64_t> last_;  // a ring
  std::size_t oldest_ = 0;
};

}  // namespace touchfield
