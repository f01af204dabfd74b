#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "sim/cameras/joint_table.h"
#include "sim/cameras/joints_hand.h"

namespace touchfield {

/// Sees the hand that is fitted to recorded joints of a hand tracker (JointsHand). It never knows the true one. Its
/// bones are learnt from the first second in which the tracker had a hand, and its frames fitted, before the clock
/// starts.
class JointsSensor final : public MotionSensor {
 public:
  /// path       of the file, for messages
  /// throws     InputError as JointsHand, and where the file has no hand
  JointsSensor(const Scene& scene, const JointRecording& recording, const std::string& path,
               KeptBodies* kept = nullptr);

  const MovingModel& solved() const override { return hand_.solved(); }
  const RecordedTimes* recording() const override { return &times_; }
  /// The newest frame at that time.
  Seen sample(std::int64_t number, double seconds) override;
  std::vector<TriangleMesh> places(int count) const override;
  std::vector<std::string> notes() const override { return notes_; }

 private:
  std::vector<JointPoints> first_second() const;
  void fit_motion(double seconds, double hz);

  JointsHand hand_;
  RecordedTimes times_;
  std::vector<std::optional<JointPoints>> joints_;
  std::vector<std::optional<JointsHand::Frame>> frames_;  // those that samples are taken of
  std::vector<std::string> notes_;
};

}  // namespace touchfield
