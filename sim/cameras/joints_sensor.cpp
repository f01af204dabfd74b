#include "sim/cameras/joints_sensor.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/core/units.h"
#include "sim/motion/loop_clock.h"

namespace touchfield {

JointsSensor::JointsSensor(const Scene& scene, const JointRecording& recording, const std::string& path,
                           KeptBodies* kept)
    : hand_(scene, kept), times_(recording.seconds), joints_(recording.joints), frames_(recording.joints.size()) {
  const std::vector<JointPoints> frames = first_second();
  if (frames.empty()) {
    throw InputError(
        fmt::format("{}: no frame has a hand: each row lacks a joint, or has all of them in one place", path));
  }
  notes_.push_back(hand_.learn(frames, path));
  fit_motion(scene.motion->seconds, scene.motion->sensor.hz);
}

/// The joints of the first second in which the tracker had a hand.
std::vector<JointPoints> JointsSensor::first_second() const {
  std::vector<JointPoints> frames;
  std::optional<double> begin;
  for (std::size_t k = 0; k < joints_.size(); ++k) {
    if (joints_[k] && times_.seconds(k) < begin.value_or(times_.seconds(k)) + JointsHand::kLearnt) {
      begin = begin.value_or(times_.seconds(k));
      frames.push_back(*joints_[k]);
    }
  }
  return frames;
}

/// All frames that are sampled, before the clock starts, so that a sample is a skin that is carried; and what is to be
/// said of them.
void JointsSensor::fit_motion(double seconds, double hz) {
  double sum = 0;
  double worst = 0;
  std::size_t fitted_well = 0;
  std::size_t empty = 0;
  std::size_t off = 0;
  std::size_t held = 0;
  for (std::int64_t k = 0; k <= last_instant(to_ticks(seconds), hz); ++k) {
    std::optional<JointsHand::Frame>& frame = frames_[times_.newest(to_seconds(instant(k, hz)))];
    if (frame) {
      continue;
    }
    frame = hand_.fitted(joints_[static_cast<std::size_t>(&frame - frames_.data())]);
    empty += frame->fault == JointsHand::Fault::kNoHand ? 1 : 0;
    off += frame->fault == JointsHand::Fault::kOff ? 1 : 0;
    held += frame->fault == JointsHand::Fault::kHeld ? 1 : 0;
    if (frame->fault != JointsHand::Fault::kNoHand) {
      sum += frame->off * frame->off;
      worst = std::max(worst, frame->off);
      ++fitted_well;
    }
  }
  if (fitted_well > 0) {
    notes_.push_back(
        fmt::format("joints: the skeleton is {:.2f} mm rms off the tracked joints, {:.2f} mm in the worst frame",
                    std::sqrt(sum / static_cast<double>(fitted_well)) / kMillimetre, worst / kMillimetre));
  }
  if (empty + off + held > 0) {
    notes_.push_back(
        fmt::format("lost: of {} frames {} have no hand; {} are more than {:g} mm rms off every skeleton's pose; {} "
                    "move fingers that touch in the pose {}, which the fit keeps as they are. Choose a pose like "
                    "theirs for the fitted hand, or flat, in which all fingers turn",
                    fitted_well + empty, empty, off, JointsHand::kMostOff / kMillimetre, held, hand_.hand().pose));
  }
}

Seen JointsSensor::sample(std::int64_t /*number*/, double seconds) {
  const std::size_t frame = times_.newest(seconds);  // of those fitted, but `live` samples at other times as well
  return hand_.seen(times_.seconds(frame), frames_[frame] ? *frames_[frame] : hand_.fitted(joints_[frame]));
}

std::vector<TriangleMesh> JointsSensor::places(int count) const {
  std::vector<JointsHand::Frame> frames;
  for (const std::optional<JointsHand::Frame>& frame : frames_) {
    if (frame) {
      frames.push_back(*frame);
    }
  }
  return hand_.places(frames, count);
}

}  // namespace touchfield
