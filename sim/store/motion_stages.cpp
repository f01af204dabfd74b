#include "sim/store/motion_stages.h"

#include <algorithm>

namespace touchfield {

std::vector<std::string> stages_of(const std::vector<MotionFrame>& frames) {
  std::vector<std::string> stages;
  for (const MotionFrame& frame : frames) {
    for (const auto& [stage, seconds] : frame.seconds) {
      if (std::ranges::find(stages, stage) == stages.end()) {
        stages.push_back(stage);
      }
    }
  }
  return stages;
}

double stage_seconds(const MotionFrame& frame, const std::string& stage) {
  const auto found = std::ranges::find(frame.seconds, stage, &std::pair<std::string, double>::first);
  return found == frame.seconds.end() ? kNotComputed : found->second;
}

double total_seconds(const MotionFrame& frame) {
  double sum = 0.0;
  for (const auto& [stage, seconds] : frame.seconds) {
    sum += seconds;
  }
  return sum;
}

double shown_displacement(const MotionScore& score) {
  return score.frame < 0 ? kNotComputed : score.displacement.norm();
}

}  // namespace touchfield
