#include "hardware/attention.h"

#include <algorithm>

#include <fmt/format.h>

namespace touchfield {

bool Attention::look(double now, double planned) {
  const double gap = now - last_ - planned;
  last_ = now;
  gaps_.count += gap > kShownGap ? 1 : 0;
  gaps_.longest = std::max(gaps_.longest, gap);
  return gap > kLongestGap;
}

std::string Attention::fault() const {
  return fmt::format(
      "did not supervise the array for {:.2f} s (at most {:g} s): it was paused, lacked processor time, or the machine "
      "slept",
      gaps_.longest, kLongestGap);
}

bool Patience::over(double now) {
  left_ -= std::min(now - last_, 2 * kPatienceStep);
  last_ = now;
  return left_ <= 0;
}

}  // namespace touchfield
