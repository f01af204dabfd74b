#pragma once

#include <cmath>
#include <numbers>

namespace touchfield {

/// The step nearest to a phase [rad] of a device that has `levels` of them a turn, round(phase levels / 2 pi) mod
/// levels: the last half step is step 0.
inline int phase_step(double phase, int levels) {
  const double turns = phase / (2.0 * std::numbers::pi);
  const auto step = static_cast<int>(std::floor((turns - std::floor(turns)) * levels + 0.5));
  return step % levels;
}

}  // namespace touchfield
