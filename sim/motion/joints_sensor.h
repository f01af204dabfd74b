#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "sim/motion/fitted_skin.h"
#include "sim/motion/recorded_times.h"
#include "sim/tracking/joint_fit.h"

namespace touchfield {

/// Sees the hand that is fitted to the joints of a hand tracker. It never knows the true one.
///
/// The lengths of its bones are learnt from the first second in which the tracker had a hand, before the clock starts.
/// Then each frame is fitted by itself. Joints that turn parts which touch in the template's pose stay as they are there.
/// A frame is lost where the tracker had no hand, where the skeleton is more than kMostOff from the joints, where parts
/// that touch in the template are more than kMostHeld apart from theirs, and where the skin is no surface.
class JointsSensor final : public MotionSensor {
 public:
  /// Trackers put wrist, knuckles and tips elsewhere in the hand: that costs 3.6 mm rms on a Quest's. Joints of the other
  /// hand are 10 mm off and more, those of a flat one alone 2.5 mm: which hand it is is told by comparing both.
  static constexpr double kMostOff = 6e-3;    // [m]
  static constexpr double kMostHeld = 15e-3;  // [m]

  /// path       of the file, for messages
  /// throws     InputError as FittedSkin; where the file ends before the motion or has no hand, where its joints are no
  ///            hand's by their size, or the other hand's
  JointsSensor(const Scene& scene, const JointRecording& recording, const std::string& path,
               KeptBodies* kept = nullptr);

  const MovingModel& solved() const override { return skin_.solved(); }
  /// The newest frame at that time.
  Seen sample(std::int64_t number, double seconds) override;
  std::vector<TriangleMesh> places(int count) const override;
  std::vector<std::string> notes() const override { return notes_; }

 private:
  enum class Fault { kNone, kNoHand, kOff, kHeld };
  struct Frame {
    Fault fault = Fault::kNoHand;
    double off = 0;  // [m], rms
    HandState state{};
  };

  std::vector<JointPoints> first_second() const;
  void learn(const std::string& path);
  void fit_motion(double seconds, double hz);
  Frame fitted(const std::optional<JointPoints>& joints) const;
  Seen seen(std::size_t frame) const;

  FittedSkin skin_;
  RecordedTimes times_;
  std::vector<std::optional<JointPoints>> joints_;
  std::optional<JointFit> fit_;
  ShapedHand shape_;
  std::vector<std::optional<Frame>> frames_;  // those that samples are taken of
  std::vector<std::string> notes_;
};

}  // namespace touchfield
