#pragma once

#include <cstddef>
#include <map>
#include <string>

#include "hardware/player.h"
#include "sim/core/json.h"
#include "sim/motion/live.h"

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
Json live_value(const LiveResult& result);

/// live.csv: a header line and one line per frame. A line begins with the frame's number, its times since the loop
/// began [s], whether it is silent, and whether it is lost. Then follow the distance of the target from its true place
/// [mm], the checksum as it was sent, and the seconds per stage. A value that a frame does not have is nan; a missing
/// checksum is empty.
std::string live_csv(const LiveReport& report, const SentChecksums& sent);

}  // namespace touchfield
