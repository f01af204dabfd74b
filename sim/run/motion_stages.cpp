#include "sim/run/motion_stages.h"

#include <algorithm>
#include <iterator>

namespace touchfield {

std::vector<std::string> stages_of(const std::vector<StageSeconds>& all) {
  std::vector<std::string> stages;
  for (const StageSeconds& one : all) {
    for (const auto& [stage, seconds] : one) {
      if (std::ranges::find(stages, stage) == stages.end()) {
        stages.push_back(stage);
      }
    }
  }
  return stages;
}

std::vector<std::string> stages_of(const std::vector<MotionFrame>& frames) {
  std::vector<StageSeconds> all;
  std::ranges::transform(frames, std::back_inserter(all), &MotionFrame::seconds);
  return stages_of(all);
}

double stage_seconds(const StageSeconds& stages, const std::string& stage) {
  const auto found = std::ranges::find(stages, stage, &std::pair<std::string, double>::first);
  return found == stages.end() ? kNotComputed : found->second;
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
