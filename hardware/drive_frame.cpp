#include "hardware/drive_frame.h"

#include <algorithm>
#include <numbers>

namespace touchfield {

DriveFrame silent_frame(std::size_t n) { return {std::vector<std::uint8_t>(n, 0), std::vector<std::uint8_t>(n, 0)}; }

Eigen::VectorXd phases_of(const DriveFrame& frame, const DriveSteps& steps) {
  const double step = 2 * std::numbers::pi / steps.phase_levels;
  return Eigen::VectorXd::NullaryExpr(static_cast<Eigen::Index>(frame.phase.size()),
                                      [&](Eigen::Index n) { return step * frame.phase[static_cast<std::size_t>(n)]; });
}

double level_of(const DriveFrame& frame, const DriveSteps& steps) {
  const auto loudest = std::max_element(frame.intensity.begin(), frame.intensity.end());
  return loudest == frame.intensity.end() ? 0 : *loudest / (steps.intensity_levels - 1.0);
}

}  // namespace touchfield
