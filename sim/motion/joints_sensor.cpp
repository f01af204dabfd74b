#include "sim/motion/joints_sensor.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/core/units.h"
#include "sim/motion/loop_clock.h"

namespace touchfield {

namespace {

constexpr double kLearnt = 1.0;              // of frames that the bones are learnt from [s]
constexpr std::size_t kComparedFrames = 12;  // of them, by which the hand's side is checked
constexpr double kLeastReach = 0.09;         // from the wrist to the middle fingertip [m]
constexpr double kMostReach = 0.27;          // [m]

const char* name_of(HandSide side) { return side == HandSide::kLeft ? "left" : "right"; }

double rms_off(const JointFit& fit, const std::vector<JointPoints>& frames) {
  const std::size_t step = (frames.size() + kComparedFrames - 1) / kComparedFrames;
  double sum = 0;
  double count = 0;
  for (std::size_t k = 0; k < frames.size(); k += step) {
    sum += std::pow(fit.fit(frames[k]).residual, 2);
    ++count;
  }
  return std::sqrt(sum / count);
}

}  // namespace

JointsSensor::JointsSensor(const Scene& scene, const JointRecording& recording, const std::string& path,
                           KeptBodies* kept)
    : skin_(scene, kept), times_(recording.seconds), joints_(recording.joints), frames_(recording.joints.size()) {
  learn(path);
  fit_motion(scene.motion->seconds, scene.motion->sensor.hz);
}

/// The joints of the first second in which the tracker had a hand.
std::vector<JointPoints> JointsSensor::first_second() const {
  std::vector<JointPoints> frames;
  std::optional<double> begin;
  for (std::size_t k = 0; k < joints_.size(); ++k) {
    if (joints_[k] && times_.seconds(k) < begin.value_or(times_.seconds(k)) + kLearnt) {
      begin = begin.value_or(times_.seconds(k));
      frames.push_back(*joints_[k]);
    }
  }
  return frames;
}

void JointsSensor::learn(const std::string& path) {
  const std::vector<JointPoints> frames = first_second();
  if (frames.empty()) {
    throw InputError(
        fmt::format("{}: no frame has a hand: each row lacks a joint, or has all of them in one place", path));
  }
  std::vector<double> reaches;
  std::ranges::transform(frames, std::back_inserter(reaches), reach_of);
  std::ranges::nth_element(reaches, reaches.begin() + static_cast<std::ptrdiff_t>(reaches.size() / 2));
  const double reach = reaches[reaches.size() / 2];
  if (!(reach >= kLeastReach && reach <= kMostReach)) {
    throw InputError(fmt::format(
        "{}: its hand is {:.4g} mm long from the wrist to the middle fingertip, must be {:g} to {:g}: names "
        "of columns must end with their unit where that is not m, as index_tip_x_mm",
        path, reach / kMillimetre, kLeastReach / kMillimetre, kMostReach / kMillimetre));
  }
  const HandShape& hand = skin_.hand().hand();
  const HandProportions by = joint_proportions(hand, frames);
  if (!by.allFinite()) {
    throw InputError(
        fmt::format("{}: wrist and knuckles do not lie to each other as in a hand: are columns exchanged?", path));
  }
  fit_.emplace(hand, by);
  const double off = rms_off(*fit_, frames);
  HandShape other = hand;
  other.side = other_side(hand.side);
  if (const double its = rms_off(JointFit(other, by), frames); its < 0.8 * off && off > kMillimetre) {
    throw InputError(fmt::format(
        "{}: the joints are of a {} hand ({:.1f} mm rms off its skeleton, {:.1f} off a {} hand's): the hand that is "
        "fitted must have side: {}; or an axis of the tracker is turned round, see motion.sensor.joints.pose",
        path, name_of(other.side), its / kMillimetre, off / kMillimetre, name_of(hand.side), name_of(other.side)));
  }
  shape_ = skin_.hand().shaped(by);
  notes_.push_back(
      fmt::format("joints: before the clock starts the lengths of the hand's bones were learnt from {} frames; it is "
                  "{:.1f} mm long "
                  "from the wrist to the middle fingertip and {:.1f} mm broad across the knuckles",
                  frames.size(), reach / kMillimetre, hand.breadth * std::exp(by(kBreadthRatio)) / kMillimetre));
}

JointsSensor::Frame JointsSensor::fitted(const std::optional<JointPoints>& joints) const {
  if (!joints) {
    return {};
  }
  const JointFitResult fit = fit_->fit(*joints);
  Frame frame{fit.residual <= kMostOff ? Fault::kNone : Fault::kOff, fit.residual, fit.state};
  const JointAngles& free = skin_.hand().free_joints();
  frame.state.joints = free.select(fit.state.joints, joint_angles(skin_.hand().pose()));
  if (frame.fault == Fault::kNone && fit_->residual(frame.state, *joints) > kMostHeld) {
    frame.fault = Fault::kHeld;
  }
  return frame;
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
    std::optional<Frame>& frame = frames_[times_.newest(to_seconds(instant(k, hz)))];
    if (frame) {
      continue;
    }
    frame = fitted(joints_[static_cast<std::size_t>(&frame - frames_.data())]);
    empty += frame->fault == Fault::kNoHand ? 1 : 0;
    off += frame->fault == Fault::kOff ? 1 : 0;
    held += frame->fault == Fault::kHeld ? 1 : 0;
    if (frame->fault != Fault::kNoHand) {
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
    notes_.push_back(fmt::format(
        "lost: of {} frames {} have no hand; {} are more than {:g} mm rms off every skeleton's pose; {} have fingers "
        "elsewhere that touch in the pose {} and stay as they are there: the fitted hand's pose must be one like "
        "theirs, or "
        "flat, whose fingers all turn",
        fitted_well + empty, empty, off, kMostOff / kMillimetre, held, skin_.hand().hand().pose));
  }
}

Seen JointsSensor::seen(std::size_t frame) const {
  const Frame fit = frames_[frame] ? *frames_[frame] : fitted(joints_[frame]);  // `live` samples at other times as well
  const double seconds = times_.seconds(frame);
  if (fit.fault != Fault::kNone) {
    return skin_.lost(seconds);
  }
  return skin_.seen(seconds, [&](const HandTemplate::Carrier& carrier, Points& world) {
    skin_.hand().carry(shape_, fit_->skeleton(fit.state.joints), carrier, world);
    world = fit.state.place(world);
  });
}

Seen JointsSensor::sample(std::int64_t /*number*/, double seconds) { return seen(times_.newest(seconds)); }

std::vector<TriangleMesh> JointsSensor::places(int count) const {
  std::vector<std::size_t> good;
  for (std::size_t k = 0; k < frames_.size(); ++k) {
    if (frames_[k] && frames_[k]->fault == Fault::kNone) {
      good.push_back(k);
    }
  }
  std::vector<TriangleMesh> meshes;
  for (int i = 0; i < count && !good.empty(); ++i) {
    const auto last = static_cast<double>(good.size() - 1);
    const Seen place = seen(good[static_cast<std::size_t>(std::lround(count > 1 ? last * i / (count - 1) : 0.0))]);
    if (!place.lost) {
      meshes.emplace_back(*place.state.skin, solved().first().body.mesh.triangles());
    }
  }
  if (meshes.empty()) {
    meshes.push_back(solved().first().body.mesh);
  }
  return meshes;
}

}  // namespace touchfield
