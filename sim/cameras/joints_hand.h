#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "sim/cameras/fitted_sensor.h"
#include "sim/cameras/hand_tables.h"
#include "sim/cameras/pose_fit.h"
#include "sim/model/clear_transducers.h"

namespace touchfield {

/// Where a skeleton has the tracked joints.
///
/// side   mirror_sign of the hand, whose own frame they are in
JointPoints joints_of(const HandSkeleton& skeleton, double side);

/// From the wrist over the bones to the tip of the middle finger [m].
double reach_of(const JointPoints& joints);

/// Proportions of a hand whose bones are as long as the joints of some frames are apart, by medians over the frames.
///
/// The palm's distances d_ij between wrist and knuckles give length and breadth, which scale the palm along and across:
///
///   min over L^2, B^2 of   sum_ij ((L^2 dy_ij^2 + B^2 (dx_ij^2 + dz_ij^2)) / d_ij - d_ij)^2
///
/// the sum of a digit's phalanges its own length. Joints say nothing of thickness: that stays to a part's length what
/// it is in the given hand, for the palm and each digit.
///
/// frames   one or more
/// returns  relative to the given hand; not finite of joints that are no hand's
HandProportions joint_proportions(const HandShape& hand, const std::vector<JointPoints>& frames);

struct JointFitResult {
  HandState state;
  double residual = 0;  // rms over the joints of how far the skeleton's are from the given ones [m]
};

/// Fits the skeleton of a hand to tracked joints, each frame by itself: Levenberg and Marquardt on
///
///   sum_j |place(x_j(q)) - p_j|^2 / (1 mm)^2 + sum_k (q_k - pose_k)^2
///
/// There are four starts of the joints q: the given pose, flat, grasp, fist. Each begins with the rigid motion that
/// carries wrist and knuckles to theirs best (Kabsch and Umeyama). The best result counts. The second sum decides what
/// the given joints leave open, such as the turn of a straight thumb about itself. Joints stay in their ranges and 10
/// degrees more.
///
/// accuracy   of 2,400 random poses of hands 155 to 215 mm long all but 10 within 0.15 mm rms, the worst 0.38 mm; with
///            noise of 2 mm rms per joint 1.4 mm rms off the true ones. About 1 ms per frame
class JointFit {
 public:
  /// hand   of which side, size and pose; the proportions are relative to it
  JointFit(const HandShape& hand, const HandProportions& by);

  JointFitResult fit(const JointPoints& joints) const;

  /// Where the skeleton of a state has the joints, in the world's frame.
  JointPoints joints(const HandState& state) const;
  HandSkeleton skeleton(const JointAngles& angles) const;
  /// sum_j |x_j - p_j|^2 / count, root [m]
  double residual(const HandState& state, const JointPoints& joints) const;

 private:
  using Rows = Eigen::Matrix<double, 3 * kTrackedJoints, kPoseUnknowns>;

  class Descent;
  double cost(const HandState& state, const JointPoints& joints) const;
  Rows derivatives(const HandState& state, const Vector3& centre) const;

  HandPose pose_;
  double length_;
  double breadth_;
  double side_;
  HandProportions by_;
  JointAngles prior_;
  JointAngles least_;
  JointAngles most_;
};

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

  enum class Fault { kNone, kNoHand, kOff, kHeld, kPlace };
  struct Frame {
    Fault fault = Fault::kNoHand;
    double off = 0;  // [m], rms
    HandState state{};
    std::optional<JointPoints> joints{};  // as they were given
    std::string place{};                  // of fault kPlace, for a person
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

  /// Once it has learnt. Its place makes no sense (kPlace) where an array cannot press on it: in the array, behind it
  /// or far away.
  Frame fitted(const std::optional<JointPoints>& joints) const;
  Seen seen(double seconds, const Frame& frame) const;
  /// The solving mesh at about so many of these frames, evenly spread; where none has a hand, as the scene has it.
  std::vector<TriangleMesh> places(const std::vector<Frame>& frames, int count) const;

 private:
  /// Why the place of a state makes no sense; empty where it does.
  std::string misplaced(const HandState& state) const;
  std::optional<ArrayContact> contact_of(const HandState& state) const;

  FittedSkin skin_;
  std::optional<JointFit> fit_;
  ShapedHand shape_;
};

/// The frames of a hand tracker whose place makes no sense.
class MisplacedHands {
 public:
  /// seconds   from the beginning of the recording or of the loop
  void add(const JointsHand::Frame& frame, double seconds);
  /// throws   InputError if there were some, and no frame had a hand in a place that makes sense
  void require_some_placed(const std::string& source) const;
  /// One line, or none.
  std::vector<std::string> warnings() const;

 private:
  std::int64_t frames_ = 0;
  std::int64_t misplaced_ = 0;
  bool placed_ = false;
  std::string first_;
};

}  // namespace touchfield
