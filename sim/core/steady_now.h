#pragma once

#include <ctime>

namespace touchfield {

/// [s] of a clock that never jumps and continues while the machine sleeps, which std::chrono::steady_clock does not.
inline double steady_now() {
  timespec now{};
  ::clock_gettime(CLOCK_BOOTTIME, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

}  // namespace touchfield
