#pragma once

#include <optional>
#include <string>
#include <vector>

#include "sim/cameras/fitted_skin.h"
#include "sim/cameras/joint_fit.h"

namespace touchfield {

/// The hand that is fitted to the joints of a hand tracker, recorded or live.
///
/// The lengths of its bones are learnt first. Then each frame is fitted by itself. Joints that turn parts which touch
/// in the template's pose keep their angles of that pose. A frame is lost
///   - where the tracker did not see a hand
///   - where the fitted skeleton is more than kMostOff from the joints (rms)
///   - where the skeleton is more than kMostHeld from the joints (rms) once those angles are kept
///   - where the skin is not a surface
class JointsHand {
 public:
  /// Trackers put wrist, knuckles and tips elsewhere in the hand: that costs 3.6 mm rms on a Quest's. Joints of the
  /// other hand are 10 mm off and more, those of a flat one alone 2.5 mm: which hand it is is told by comparing both.
  static constexpr double kMostOff = 6e-3;    // [m]
  static constexpr double kMostHeld = 15e-3;  // [m]
  static constexpr double kLearnt = 1.0;      // of frames that the bones are learnt from [s]

  enum class Fault { kNone, kNoHand, kOff, kHeld };
  struct Frame {
    Fault fault = Fault::kNoHand;
    double off = 0;  // [m], rms
    HandState state{};
  };

  /// throws   InputError as FittedSkin
  JointsHand(const Scene& scene, KeptBodies* kept) : skin_(scene, kept) {}

  const MovingModel& solved() const { return skin_.solved(); }
  const HandShape& hand() const { return skin_.hand().hand(); }

  /// Learns the lengths of the bones.
  ///
  /// frames    one or more, of about kLearnt seconds
  /// source    where they are from, for messages
  /// returns   what it learnt, for a person
  /// throws    InputError where the joints are no hand's by their size, or the other hand's
  std::string learn(const std::vector<JointPoints>& frames, const std::string& source);

  /// Once it has learnt.
  Frame fitted(const std::optional<JointPoints>& joints) const;
  Seen seen(double seconds, const Frame& frame) const;
  /// The solving mesh at about so many of these frames, evenly spread; where none has a hand, as the scene has it.
  std::vector<TriangleMesh> places(const std::vector<Frame>& frames, int count) const;

 private:
  FittedSkin skin_;
  std::optional<JointFit> fit_;
  ShapedHand shape_;
};

}  // namespace touchfield
