#pragma once

#include <string>
#include <vector>

#include "sim/run/motion_data.h"

/// What files, tables and pictures of a motion read off its frames and scores.
namespace touchfield {

/// All stages, in the order in which they first appear.
std::vector<std::string> stages_of(const std::vector<StageSeconds>& all);
std::vector<std::string> stages_of(const std::vector<MotionFrame>& frames);

/// How long a stage took [s]; NaN if there was none.
double stage_seconds(const StageSeconds& stages, const std::string& stage);
inline double stage_seconds(const MotionFrame& frame, const std::string& stage) {
  return stage_seconds(frame.seconds, stage);
}

/// All stages of a frame [s].
double total_seconds(const MotionFrame& frame);

/// How far the target's patch is from where the shown frame's sample has it [m]; NaN while the array shows no frame.
double shown_displacement(const MotionScore& score);

}  // namespace touchfield
