#include "sim/motion/recorded_times.h"

#include <algorithm>
#include <utility>

#include "sim/motion/loop_clock.h"
#include "sim/motion/running_median.h"

namespace touchfield {

RecordedTimes::RecordedTimes(std::vector<double> seconds) : seconds_(std::move(seconds)) {
  const double begin = seconds_.front();
  for (double& time : seconds_) {
    time -= begin;
  }
}

std::size_t RecordedTimes::newest(double seconds) const {
  const auto after = std::upper_bound(seconds_.begin() + 1, seconds_.end(), seconds + 0.5 / kTicksASecond);
  return static_cast<std::size_t>(after - seconds_.begin()) - 1;
}

double RecordedTimes::covered() const {
  RunningMedian period;  // [ticks]
  for (std::size_t k = 1; k < seconds_.size(); ++k) {
    period.add(to_ticks(seconds_[k]) - to_ticks(seconds_[k - 1]));
  }
  return to_seconds(to_ticks(seconds_.back()) + period.value());
}

}  // namespace touchfield
