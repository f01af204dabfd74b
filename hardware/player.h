#pragma once

#include <cstddef>
#include <functional>

#include "hardware/array_link.h"

namespace touchfield {

/// The time that a player keeps, and who may stop it.
class Pace {
 public:
  Pace() = default;
  Pace(const Pace&) = delete;
  Pace& operator=(const Pace&) = delete;
  virtual ~Pace() = default;

  /// [s] since a moment of its own.
  virtual double now() = 0;
  /// Returns at time t [s], or at once if it is over; false: stop playing.
  virtual bool wait_until(double t) = 0;
};

struct PlayOptions {
  double rate = 1;      // [frames/s], > 0
  double seconds = 1;   // in all, > 0; the last frame is held
  bool repeat = false;  // begin again after the last frame
};

struct PlayReport {
  std::size_t sent = 0;
  std::size_t dropped = 0;  // overtaken: a newer one was due before they could be sent
  std::size_t late = 0;     // sent more than half a period after they were due
  double worst_delay = 0;   // of a frame that was sent [s]
  double seconds = 0;       // played
  bool stopped = false;     // by the pace, before its time
};

/// The frame of a number from 0; may take its time.
using FrameSource = std::function<DriveFrame(std::size_t number)>;
/// Told after each frame that was sent.
using FrameObserver = std::function<void(std::size_t number, const DriveFrame& frame)>;

/// Sends frame n at time n / rate after the start. Latest wins: a source or a device that takes too long makes the
/// frames that are overtaken drop out, it never makes a queue; only the last one of a sequence is always sent. While a
/// frame is held the device is asked for several times a second whether it is still there.
///
/// count    frames there are, >= 1
/// throws   InputError if a rate or a time is not positive or the rate is more than the link carries; what the link and
///          the source throw
PlayReport play(std::size_t count, const FrameSource& source, ArrayLink& link, const PlayOptions& options, Pace& pace,
                const FrameObserver& observer = {});

}  // namespace touchfield
