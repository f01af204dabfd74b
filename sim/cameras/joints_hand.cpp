#include "sim/cameras/joints_hand.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/core/units.h"

namespace touchfield {

namespace {

constexpr std::size_t kComparedFrames = 12;  // of them, by which the hand's side is checked
constexpr double kLeastReach = 0.09;         // from the wrist to the middle fingertip [m]
constexpr double kMostReach = 0.27;          // [m]

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

std::string JointsHand::learn(const std::vector<JointPoints>& frames, const std::string& source) {
  std::vector<double> reaches;
  std::ranges::transform(frames, std::back_inserter(reaches), reach_of);
  std::ranges::nth_element(reaches, reaches.begin() + static_cast<std::ptrdiff_t>(reaches.size() / 2));
  const double reach = reaches[reaches.size() / 2];
  if (!(reach >= kLeastReach && reach <= kMostReach)) {
    throw InputError(
        fmt::format("{}: its hand is {:.4g} mm long from the wrist to the middle fingertip, must be {:g} to {:g}: "
                    "lengths are in m; "
                    "another unit ends the names of a file's columns, as index_tip_x_mm",
                    source, reach / kMillimetre, kLeastReach / kMillimetre, kMostReach / kMillimetre));
  }
  const HandShape& hand = skin_.hand().hand();
  const HandProportions by = joint_proportions(hand, frames);
  if (!by.allFinite()) {
    throw InputError(
        fmt::format("{}: wrist and knuckles are not arranged as in a hand: are columns exchanged?", source));
  }
  fit_.emplace(hand, by);
  const double off = rms_off(*fit_, frames);
  HandShape other = hand;
  other.side = other_side(hand.side);
  if (const double its = rms_off(JointFit(other, by), frames); its < 0.8 * off && off > kMillimetre) {
    throw InputError(fmt::format(
        "{}: the joints are of a {} hand ({:.1f} mm rms off its skeleton, {:.1f} off a {} hand's): the hand that is "
        "fitted must have side: {}; or an axis of the tracker is reversed, see motion.sensor.joints.pose",
        source, side_name(other.side), its / kMillimetre, off / kMillimetre, side_name(hand.side),
        side_name(other.side)));
  }
  shape_ = skin_.hand().shaped(by);
  return fmt::format(
      "joints: before the clock starts the lengths of the hand's bones were learnt from {} frames; it is {:.1f} mm "
      "long "
      "from the wrist to the middle fingertip and {:.1f} mm broad across the knuckles",
      frames.size(), reach / kMillimetre, hand.breadth * std::exp(by(kBreadthRatio)) / kMillimetre);
}

JointsHand::Frame JointsHand::fitted(const std::optional<JointPoints>& joints) const {
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

Seen JointsHand::seen(double seconds, const Frame& frame) const {
  if (frame.fault != Fault::kNone) {
    return skin_.lost(seconds);
  }
  return skin_.seen(seconds, [&](const HandTemplate::Carrier& carrier, Points& world) {
    skin_.hand().carry(shape_, fit_->skeleton(frame.state.joints), carrier, world);
    world = frame.state.place(world);
  });
}

std::vector<TriangleMesh> JointsHand::places(const std::vector<Frame>& frames, int count) const {
  std::vector<const Frame*> good;
  for (const Frame& frame : frames) {
    if (frame.fault == Fault::kNone) {
      good.push_back(&frame);
    }
  }
  std::vector<TriangleMesh> meshes;
  for (int i = 0; i < count && !good.empty(); ++i) {
    const auto last = static_cast<double>(good.size() - 1);
    const Seen place = seen(0, *good[static_cast<std::size_t>(std::lround(count > 1 ? last * i / (count - 1) : 0.0))]);
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
