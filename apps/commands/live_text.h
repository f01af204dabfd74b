#pragma once

#include <string>

#include "hardware/player.h"
#include "sim/motion/live.h"
#include "sim/store/value_tree.h"

namespace touchfield {

/// What a live loop did, and how what it found was played.
struct LiveResult {
  MotionSpec motion;
  LiveReport loop;
  PlayReport play;
};

/// Frames, silences, and the median, 95th percentile and worst of times, those of `solve` by stage.
Value live_value(const LiveResult& result);

/// live.csv: a header line and a line a frame: number, times since the loop began [s], whether it is quiet, and lost,
/// seconds a stage; nan where a frame was without it.
std::string live_csv(const LiveReport& report);

}  // namespace touchfield
