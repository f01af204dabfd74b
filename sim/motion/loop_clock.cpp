#include "sim/motion/loop_clock.h"

#include <stdexcept>
#include <utility>

#include <fmt/format.h>

#include "sim/core/require.h"

namespace touchfield {

RecordedTimes::RecordedTimes(std::vector<double> seconds) : seconds_(std::move(seconds)) {
  const double begin = seconds_.front();
  for (double& time : seconds_) {
    time -= begin;
  }
}

std::size_t RecordedTimes::newest(double seconds) const {
  const auto after = std::upper_bound(seconds_.begin() + 1, seconds_.end(), seconds + 0.5 / kTicksASecond);
  return static_cast<std::size_t>(after - seconds_.begin()) - 1;
}

double RecordedTimes::usual_step() const {
  RunningMedian period;  // [ticks]
  for (std::size_t k = 1; k < seconds_.size(); ++k) {
    period.add(to_ticks(seconds_[k]) - to_ticks(seconds_[k - 1]));
  }
  return to_seconds(period.value());
}

double RecordedTimes::covered() const { return to_seconds(to_ticks(seconds_.back()) + to_ticks(usual_step())); }

std::string step_warning(const RecordedTimes& times, double hz) {
  constexpr double kFactor = 10;
  const double step = times.usual_step();
  if (!(step > 0) || (step * hz < kFactor && step * hz > 1 / kFactor)) {
    return "";
  }
  std::string remedy = fmt::format("if time_s is right, set motion.sensor.hz to about {:.4g}", 1 / step);
  for (const auto& [unit, each] : {std::pair("ms", 1e3), std::pair("us", 1e6), std::pair("ns", 1e9)}) {
    if (step / each > 1e-3 && step / each < 0.2) {
      remedy = fmt::format("time_s must be in s: divide it by {:.0f} if it is in {}", each, unit);
    }
  }
  return fmt::format("times: frames of the recording are {:.4g} s apart, {} the {:.3g} s of motion.sensor.hz: {:g}; {}",
                     step, step * hz > 1 ? fmt::format("{:.0f} times", step * hz) : fmt::format("{:.2g} of", step * hz),
                     1 / hz, hz, remedy);
}

namespace {

double required(const char* name, double value, bool positive) {
  require(std::isfinite(value) && (positive ? value > 0.0 : value >= 0.0), "motion.{} = {:.15g} must be {}", name,
          value, positive ? "> 0" : ">= 0");
  return value;
}

}  // namespace

std::int64_t last_instant(Tick tick, double hz) {
  if (tick < 0) {
    return -1;
  }
  auto number = static_cast<std::int64_t>(static_cast<double>(tick) * hz / kTicksASecond);
  while (instant(number + 1, hz) <= tick) {
    ++number;
  }
  while (instant(number, hz) > tick) {
    --number;
  }
  return number;
}

LoopClock::LoopClock(const MotionSpec& motion)
    : frames_hz_(required("frames_hz", motion.frames_hz, true)),
      sensor_hz_(required("sensor.hz", motion.sensor.hz, true)),
      score_hz_(required("score_hz", motion.score_hz, true)),
      end_(to_ticks(required("seconds", motion.seconds, true))),
      latency_(to_ticks(required("sensor.latency_ms", motion.sensor.latency, false))),
      array_(to_ticks(required("array_ms", motion.array_delay, false))) {
  if (motion.solve) {
    solve_ = to_ticks(required("solve_ms", *motion.solve, false));
  }
}

std::optional<FrameStart> LoopClock::next() {
  if (open_) {
    throw std::logic_error("LoopClock::next: the frame before is not finished");
  }
  std::int64_t dropped = 0;
  while (!over_) {
    const std::int64_t slot = std::max(slot_, last_instant(free_, frames_hz_));
    const Tick due = instant(slot, frames_hz_);
    const Tick at = std::max(due, free_);
    if (at >= end_) {  // nothing starts any more: slots until the end that were missed, this one too, are dropped
      dropped_ += std::max<std::int64_t>(0, last_instant(end_ - 1, frames_hz_) + 1 - slot_);
      over_ = true;
      break;
    }
    dropped += slot - slot_;
    dropped_ += slot - slot_;
    slot_ = slot + 1;
    const std::int64_t sample = last_instant(at - latency_, sensor_hz_);
    if (sample < 0) {
      ++waiting_;
      continue;
    }
    late_ += at > due ? 1 : 0;
    open_ = FrameStart{frames_++, at, due, sample, instant(sample, sensor_hz_), dropped};
    return open_;
  }
  return std::nullopt;
}

ShownFrame LoopClock::finished(Tick solve) {
  if (!open_ || solve < 0) {
    throw std::logic_error("LoopClock::finished: no frame was started, or it took less than no time");
  }
  free_ = open_->at + solve;
  shown_.push_back({*open_, free_ + array_});
  open_.reset();
  solves_.add(solve);
  return shown_.back();
}

std::optional<ScoreInstant> LoopClock::next_score() {
  const Tick at = instant(score_, score_hz_);
  const bool settled = over_ || (!shown_.empty() && at < shown_.back().from);
  if (at >= end_ || !settled) {
    return std::nullopt;
  }
  while (shown_.size() > 1 && shown_[1].from <= at) {
    shown_.pop_front();
  }
  ScoreInstant score{score_++, at, std::nullopt};
  if (!shown_.empty() && shown_.front().from <= at) {
    score.frame = shown_.front();
  }
  return score;
}

Tick LoopClock::predicted_for(const FrameStart& frame, Tick solve) const {
  return frame.at + solve + array_ + instant(1, 2.0 * frames_hz_);
}

}  // namespace touchfield
