#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "sim/scene/scene.h"

namespace touchfield {

/// The median of the last kRemembered numbers; of an even number the lower one of the two in the middle, 0 of none.
class RunningMedian {
 public:
  static constexpr std::size_t kRemembered = 31;

  RunningMedian() { last_.reserve(kRemembered); }

  void add(std::int64_t value) {
    if (last_.size() < kRemembered) {
      last_.push_back(value);
    } else {
      last_[oldest_] = value;
      oldest_ = (oldest_ + 1) % kRemembered;
    }
  }

  std::int64_t value() const {
    if (last_.empty()) {
      return 0;
    }
    std::vector<std::int64_t> sorted = last_;
    const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>((sorted.size() - 1) / 2);
    std::ranges::nth_element(sorted, middle);
    return *middle;
  }

 private:
  std::vector<std::int64_t> last_;  // a ring
  std::size_t oldest_ = 0;
};

/// The times of a recording, counted from its first frame.
class RecordedTimes {
 public:
  /// seconds   rising, from any start; one or more
  explicit RecordedTimes(std::vector<double> seconds);

  std::size_t size() const { return seconds_.size(); }
  double seconds(std::size_t frame) const { return seconds_.at(frame); }
  /// The newest frame at a time [s], which may be half a tick of the clock early.
  std::size_t newest(double seconds) const;
  /// The median of the last 32 times between two frames [s]; 0 of a single one.
  double usual_step() const;
  /// What is recorded [s]: the last frame holds for as long as one usually does.
  double covered() const;

 private:
  std::vector<double> seconds_;
};

/// "times: ..." where the times of a recording are hardly seconds: its usual step is ten times that of the samples or
/// more, or a tenth or less. Else empty.
///
/// hz   samples per second
std::string step_warning(const RecordedTimes& times, double hz);

/// Time since the motion began [us].
using Tick = std::int64_t;

inline constexpr double kTicksASecond = 1e6;

/// The nearest tick.
inline Tick to_ticks(double seconds) { return std::llround(seconds * kTicksASecond); }
inline double to_seconds(Tick ticks) { return static_cast<double>(ticks) / kTicksASecond; }

/// When number k of what comes `hz` times per second is due, round(k 1e6 / hz).
inline Tick instant(std::int64_t number, double hz) {
  return std::llround(static_cast<double>(number) * kTicksASecond / hz);
}
/// The last one due at or before a tick; -1 if there is none.
std::int64_t last_instant(Tick tick, double hz);

/// A frame that starts: from here on its solver is busy.
struct FrameStart {
  std::int64_t number = 0;   // from 0
  Tick at = 0;               // when it starts
  Tick due = 0;              // its slot, at or before that
  std::int64_t sample = 0;   // the newest one known then
  Tick sampled = 0;          // when that was taken
  std::int64_t dropped = 0;  // slots that passed between the frame before and this one's own

  Tick late() const { return at - due; }
};

/// A frame on the array, from `from` until the next one's `from`.
struct ShownFrame {
  FrameStart start;
  Tick from = 0;
};

struct ScoreInstant {
  std::int64_t number = 0;  // from 0
  Tick at = 0;
  std::optional<ShownFrame> frame;  // none yet: the array is silent

  /// Time since the sample that is felt was taken; there must be a frame.
  Tick age() const { return at - frame->start.sampled; }
};

/// The loop of sensor, solver and array on a clock of whole ticks.
///
/// Sample k is taken at round(k 1e6 / sensor.hz) and known sensor.latency later. Slot j of a frame is at
/// round(j 1e6 / frames_hz), score k at round(k 1e6 / score_hz). All count from 0 and lie before the motion's end.
/// Nothing is accumulated, so that rates keep their ratio.
///
/// A slot at which the solver is free starts its frame at once, with the newest sample known by then. A sample that
/// becomes known at that very tick counts. A slot at which the solver is busy waits. When the solver becomes free, the
/// latest slot that has come by then starts a frame at once, unless it started one before. That frame is late, with the
/// newest sample known at that time. Earlier slots are dropped. Nothing is queued, and the slots after it stay where
/// they are. The solver is free again at the very tick at which a frame's solve ends. A slot before any sample is known
/// has no frame and counts as waiting. A frame is on the array array_ms after its solve ends, until the next one is. It
/// is scored from that very tick on.
///
///     LoopClock clock(motion);
///     while (const auto frame = clock.next()) {
///       clock.finished(solve(*frame));
///       while (const auto score = clock.next_score()) { ... }
///     }
///     while (const auto score = clock.next_score()) { ... }
class LoopClock {
 public:
  /// throws   InputError if a rate or the motion's length is not > 0, or a delay not >= 0
  explicit LoopClock(const MotionSpec& motion);

  /// The frame that starts next; nothing once the motion is over.
  /// throws   std::logic_error unless the frame before is finished
  std::optional<FrameStart> next();

  /// The frame that was started last has taken `solve` ticks.
  /// throws   std::logic_error if there is none, or solve < 0
  ShownFrame finished(Tick solve);

  /// The next score instant, if the frame on the array then is settled. It is settled before the frame that was
  /// finished last comes on. Once the motion is over, all are settled.
  std::optional<ScoreInstant> next_score();

  /// The middle of the time that a frame will be shown, if it takes `solve` and the next one comes on time:
  ///
  ///     its start + solve + array_ms + half of 1 / frames_hz
  Tick predicted_for(const FrameStart& frame, Tick solve) const;
  Tick predicted_for(const FrameStart& frame) const { return predicted_for(frame, expected_solve()); }

  /// solve_ms, or of `measured` the running median of the frames'.
  Tick expected_solve() const { return solve_.value_or(solves_.value()); }

  std::int64_t frames() const { return frames_; }    // started
  std::int64_t late() const { return late_; }        // frames that started after their slot
  std::int64_t dropped() const { return dropped_; }  // slots without a frame because the solver was busy
  std::int64_t waiting() const { return waiting_; }  // slots without a frame because no sample was known

 private:
  double frames_hz_;
  double sensor_hz_;
  double score_hz_;
  Tick end_;
  Tick latency_;
  Tick array_;
  std::optional<Tick> solve_;

  std::int64_t slot_ = 0;           // the first that has not been reckoned with
  Tick free_ = 0;                   // from when on the solver is
  std::optional<FrameStart> open_;  // started and not finished
  bool over_ = false;
  std::int64_t frames_ = 0;
  std::int64_t late_ = 0;
  std::int64_t dropped_ = 0;
  std::int64_t waiting_ = 0;
  std::deque<ShownFrame> shown_;  // finished; from the one that the next score may be of
  std::int64_t score_ = 0;
  RunningMedian solves_;
};

}  // namespace touchfield
