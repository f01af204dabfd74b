#pragma once

#include <cstddef>
#include <functional>
#include <optional>

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
  // Of a stream:
  std::size_t stale = 0;     // frames that were too old when they came
  std::size_t silences = 0;  // times it fell silent because what it had became too old
  double silent = 0;         // how long these were together [s]
};

/// The frame of a number from 0; may take its time.
using FrameSource = std::function<DriveFrame(std::size_t number)>;
/// Told after each frame that was sent.
using FrameObserver = std::function<void(std::size_t number, const DriveFrame& frame)>;

/// Sends frame n at time n / rate after the start. The latest frame wins: if a source or a device takes too long,
/// overtaken frames are dropped and never make a queue. The last frame of a sequence is always sent, unless the time is
/// over before. While a frame is held, the device is asked several times per second whether it is still there.
///
/// count    frames there are, >= 1
/// report   gets what was done, also until something is thrown
/// throws   InputError if a rate or a time is not positive or the rate is more than the link carries; errors of the
///          link and the source
void play(std::size_t count, const FrameSource& source, ArrayLink& link, const PlayOptions& options, Pace& pace,
          PlayReport& report, const FrameObserver& observer = {});

/// Lets the device store frames and play them by its own clock, again and again, for the time of the options. While it
/// plays it is asked several times per second whether it is still there.
///
/// frames   at least 2
/// report   gets what was done, also until something is thrown: `sent` are the stored frames
/// throws   InputError if a time is not positive, or the device cannot store or play them; what the link throws
void play_stored(const std::vector<DriveFrame>& frames, ArrayLink& link, const PlayOptions& options, Pace& pace,
                 PlayReport& report);

struct StreamFrame {
  std::size_t number = 0;
  double seen = 0;  // when that was so which it is for [s]
  DriveFrame frame;
};

/// Frames that come while they are played. Times are those of the pace; none of these functions may wait.
struct FrameStream {
  std::function<void(double now)> begin;                         // they are wanted from now on
  std::function<std::optional<StreamFrame>()> newest;            // unless it was given before
  std::function<void(std::size_t number, double at)> committed;  // the link has taken this one
  std::function<bool()> over;                                    // no more will come
  /// Told of each frame that was sent or was too old, with its age then [s], and of each silence.
  std::function<void(const PlayReport& so_far, bool sounds, double age)> told{};  // may be empty
  double stale = 0.15;                                                            // [s], > 0
};

/// Sends the newest frame of a stream as soon as it is there, at most as many per second as the link carries. The array
/// is silent before the first frame. It is silenced when the observation (StreamFrame::seen) behind its frame becomes
/// older than stream.stale and no newer frame comes. Frames that are already that old when they come are not sent. The
/// array is silenced at the end, also after an error.
///
/// seconds   after which it ends, if the stream is not over before and the pace does not stop it
/// report    gets what was done, also until something is thrown
/// throws    InputError if a time is not positive; errors of the link and the stream's functions
void play(const FrameStream& stream, ArrayLink& link, double seconds, Pace& pace, PlayReport& report,
          const FrameObserver& observer = {});

}  // namespace touchfield
