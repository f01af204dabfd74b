#include "sim/cameras/live_joints_sensor.h"

#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/core/version.h"

namespace touchfield {

LiveJointsSensor::LiveJointsSensor(const Scene& scene, int port, const RigidMotion& pose, KeptBodies* kept)
    : hand_(scene, kept), socket_(port, pose) {}

void LiveJointsSensor::start(Progress& progress) {
  constexpr double kLook = 0.1;  // [s] between looks at the clock
  progress.note(fmt::format("joints: waiting for a hand on {}", socket_.name()));
  std::vector<JointPoints> frames;
  const double begin = steady_now();
  double end = begin + kPatience;
  while (steady_now() < end) {
    const auto received = socket_.next(kLook);
    if (received && received->joints) {
      end = frames.empty() ? steady_now() + JointsHand::kLearnt : end;
      frames.push_back(*received->joints);
    }
  }
  if (frames.empty()) {
    throw InputError(
        fmt::format("{}: no hand came within {:g} s; start the tracker's program before `touchfield live`, "
                    "and let it send to 127.0.0.1",
                    socket_.name(), kPatience));
  }
  notes_ = {hand_.learn(frames, socket_.name())};
  learnt_.clear();
  for (const JointPoints& joints : frames) {
    learnt_.push_back(hand_.fitted(joints));
  }
}

Seen LiveJointsSensor::sample(std::int64_t /*number*/, double seconds) {
  const auto received = socket_.newest();
  if (!received || received->age > kSilence) {
    return hand_.seen(seconds, {});
  }
  return hand_.seen(seconds - received->age, hand_.fitted(received->joints));
}

std::vector<TriangleMesh> LiveJointsSensor::places(int count) const { return hand_.places(learnt_, count); }

}  // namespace touchfield
