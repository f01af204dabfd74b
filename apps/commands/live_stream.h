#pragma once

#include <optional>

#include "hardware/emission/emission.h"
#include "sim/motion/live.h"

namespace touchfield {

/// The frames of a loop as a player takes them; it begins with the playing, whose clock must be the loop's.
///
/// loop   has to outlive the stream
inline FrameStream stream_of(LiveLoop& loop, const MotionSpec& motion, const Rounding& rounded) {
  FrameStream stream;
  stream.stale = motion.stale;
  stream.begin = [&loop](double now) { loop.begin(now); };
  stream.over = [&loop] { return loop.over(); };
  stream.committed = [&loop](std::size_t number, double at) { loop.committed(number, at); };
  stream.newest = [&loop, rounded]() -> std::optional<StreamFrame> {
    const auto solved = loop.take();
    if (!solved) {
      return std::nullopt;
    }
    const PhaseSolution& solution = solved->frame.solution;
    return StreamFrame{solved->number, loop.begun() + solved->frame.sampled,
                       rounded({solution.phases, solution.amplitudes})};
  };
  return stream;
}

}  // namespace touchfield
