#pragma once

#include <cstddef>
#include <map>
#include <string>

#include "hardware/player.h"
#include "sim/motion/live.h"
#include "sim/store/value_tree.h"

namespace touchfield {

/// Of the frames that the link took, by their numbers: the CRC-32 of the phase steps and then the intensity steps, a
/// byte a transducer.
using SentChecksums = std::map<std::size_t, std::string>;

/// What a live loop did, and how what it found was played.
struct LiveResult {
  MotionSpec motion;
  LiveReport loop;
  PlayReport play;
  SentChecksums sent;
};

/// Frames, silences, and the median, 95th percentile and worst of times, those of `solve` by stage.
Value live_value(const LiveResult& result);

/// live.csv: a header line and one line per frame: number, times since the loop began [s], whether it is quiet, and
/// lost, checksum as it was sent, seconds per stage; nan, or no checksum, where a frame was without it.
std::string live_csv(const LiveReport& report, const SentChecksums& sent);

}  // namespace touchfield
