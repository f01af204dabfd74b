#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "sim/cameras/joint_socket.h"
#include "sim/cameras/joints_hand.h"

namespace touchfield {

/// Sees the hand that is fitted to joints which a hand tracker sends while the motion plays (JointsHand, JointSocket).
class LiveJointsSensor final : public MotionSensor {
 public:
  static constexpr double kPatience = 60;  // for a hand before the clock starts [s]
  static constexpr double kSilence = 0.2;  // of the tracker, after which the hand is lost [s]

  /// throws   InputError as JointsHand and JointSocket
  LiveJointsSensor(const Scene& scene, int port, const RigidMotion& pose, KeptBodies* kept = nullptr);

  const MovingModel& solved() const override { return hand_.solved(); }
  /// Learns the bones from the first second in which the tracker has a hand.
  ///
  /// throws    InputError as JointsHand::learn, where a datagram is no row of joints, and where no hand comes in
  ///           kPatience
  void start(Progress& progress) override;
  std::vector<std::string> notes() const override { return notes_; }
  /// The newest frame, whose time is this less the age of its datagram.
  Seen sample(std::int64_t number, double seconds) override;
  /// Those while the bones were learnt.
  std::vector<TriangleMesh> places(int count) const override;

 private:
  JointsHand hand_;
  JointSocket socket_;
  std::vector<JointsHand::Frame> learnt_;
  std::vector<std::string> notes_;
};

}  // namespace touchfield
