#include "sim/cameras/joints_hand.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>
#include <utility>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/QR>
#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/core/require.h"
#include "sim/core/text.h"
#include "sim/core/units.h"
#include "solvers/phase/levenberg_marquardt.h"

namespace touchfield {

namespace {

constexpr double kScale = 1e-3;           // of the joints' distances against the prior's radians [m]
constexpr double kFirstDamping = 1e-3;    // of the curvature
constexpr int kSteps = 60;                // tried from each start
constexpr double kBeyond = 10 * kDegree;  // the joints' ranges, as PoseFit has it
constexpr std::array<Eigen::Index, 5> kPalm = {0, 4, 8, 12, 16};  // wrist and knuckles
constexpr Eigen::Index kMiddleKnuckle = 8;
constexpr Eigen::Index kMiddleTip = 11;

/// The first of a digit's joints, and how many there are: the thumb's base, in the palm, is none of them.
constexpr Eigen::Index first_of(Eigen::Index digit) { return digit == 0 ? 1 : 4 * digit; }
constexpr Eigen::Index count_of(Eigen::Index digit) { return digit == 0 ? 3 : 4; }

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

double median_distance(const std::vector<JointPoints>& frames, Eigen::Index i, Eigen::Index j) {
  std::vector<double> distances;
  std::ranges::transform(frames, std::back_inserter(distances),
                         [&](const JointPoints& frame) { return (frame.col(i) - frame.col(j)).norm(); });
  return median(std::move(distances));
}

double phalanges(const std::vector<JointPoints>& frames, Eigen::Index digit) {
  double sum = 0;
  for (Eigen::Index j = first_of(digit) + 1; j < first_of(digit) + count_of(digit); ++j) {
    sum += median_distance(frames, j - 1, j);
  }
  return sum;
}

}  // namespace

JointPoints joints_of(const HandSkeleton& skeleton, double side) {
  JointPoints joints;
  joints.col(0).setZero();
  for (Eigen::Index d = 0; d < 5; ++d) {
    for (Eigen::Index i = 0; i < count_of(d); ++i) {
      joints.col(first_of(d) + i) =
          skeleton.digit(static_cast<std::size_t>(d)).joints[static_cast<std::size_t>(4 - count_of(d) + i)];
    }
  }
  joints.row(0) *= side;
  return joints;
}

double reach_of(const JointPoints& joints) {
  double reach = (joints.col(kMiddleKnuckle) - joints.col(0)).norm();
  for (Eigen::Index j = kMiddleKnuckle + 1; j < kMiddleKnuckle + 4; ++j) {
    reach += (joints.col(j) - joints.col(j - 1)).norm();
  }
  return reach;
}

HandProportions joint_proportions(const HandShape& hand, const std::vector<JointPoints>& frames) {
  const JointPoints own = joints_of(posed_skeleton(hand_pose(hand.pose, hand.joints), hand.length, hand.breadth), 1.0);
  Eigen::Matrix<double, 10, 2> squares;
  Eigen::Matrix<double, 10, 1> distances;
  Eigen::Index row = 0;
  for (std::size_t a = 0; a < kPalm.size(); ++a) {
    for (std::size_t b = 0; b < a; ++b, ++row) {
      const Vector3 square = (own.col(kPalm[a]) - own.col(kPalm[b])).cwiseAbs2();
      distances(row) = median_distance(frames, kPalm[a], kPalm[b]);
      squares.row(row) << square.y() / distances(row), (square.x() + square.z()) / distances(row);
    }
  }
  const Eigen::Vector2d ratios = squares.colPivHouseholderQr().solve(distances);
  HandProportions by;
  by(kLengthRatio) = 0.5 * std::log(ratios(0));
  by(kBreadthRatio) = 0.5 * std::log(ratios(1));
  by(kPalmRatio) = by(kLengthRatio) - by(kBreadthRatio);
  for (Eigen::Index d = 0; d < 5; ++d) {
    const double longer = std::log(phalanges(frames, d) / phalanges({own}, d));
    by(kDigitRatios + d) = longer - by(kLengthRatio);
    by(kGirthRatios + d) = longer - by(kBreadthRatio);
  }
  return by;
}

JointFit::JointFit(const HandShape& hand, const HandProportions& by)
    : pose_(hand_pose(hand.pose, hand.joints)),
      length_(hand.length),
      breadth_(hand.breadth),
      side_(mirror_sign(hand.side)),
      by_(by),
      prior_(joint_angles(pose_)),
      least_(joint_ranges().least.array() - kBeyond),
      most_(joint_ranges().most.array() + kBeyond) {}

HandSkeleton JointFit::skeleton(const JointAngles& angles) const {
  return proportioned_skeleton(with_angles(pose_, angles), length_, breadth_, by_);
}

JointPoints JointFit::joints(const HandState& state) const {
  return (state.place.rotation * joints_of(skeleton(state.joints), side_)).colwise() + state.place.shift;
}

double JointFit::residual(const HandState& state, const JointPoints& given) const {
  return std::sqrt((joints(state) - given).squaredNorm() / static_cast<double>(kTrackedJoints));
}

double JointFit::cost(const HandState& state, const JointPoints& given) const {
  return (joints(state) - given).squaredNorm() / (kScale * kScale) + (state.joints - prior_).squaredNorm();
}

/// By differences for the joints: a joint moves its own digit alone, so that one of each digit is turned at a time.
JointFit::Rows JointFit::derivatives(const HandState& state, const Vector3& centre) const {
  constexpr double kTurn = 1e-6;
  const JointPoints at = joints(state);
  Rows rows = Rows::Zero();
  for (Eigen::Index j = 0; j < kTrackedJoints; ++j) {
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      rows.block<3, 1>(3 * j, axis) = Vector3::Unit(axis).cross(at.col(j) - centre);
      rows(3 * j + axis, 3 + axis) = 1.0;
    }
  }
  for (Eigen::Index k = 0; k < 5; ++k) {
    const Eigen::Index digits = k < 4 ? 5 : 1;  // the thumb has a joint more
    HandState turned = state;
    for (Eigen::Index d = 0; d < digits; ++d) {
      turned.joints(first_joint(static_cast<std::size_t>(d)) + k) += kTurn;
    }
    const JointPoints then = joints(turned);
    for (Eigen::Index d = 0; d < digits; ++d) {
      for (Eigen::Index j = first_of(d); j < first_of(d) + count_of(d); ++j) {
        rows.block<3, 1>(3 * j, kPlaceUnknowns + first_joint(static_cast<std::size_t>(d)) + k) =
            (then.col(j) - at.col(j)) / kTurn;
      }
    }
  }
  return rows;
}

/// The fit of a frame from one start, with the linear model where it is.
class JointFit::Descent {
 public:
  Descent(const JointFit& fit, const JointPoints& given, HandState start)
      : fit_(fit), given_(given), centre_(given.rowwise().mean()), state_(std::move(start)), next_(state_) {
    cost_ = fit_.cost(state_, given_);
    linearise();
  }

  const HandState& state() const { return state_; }
  double cost() const { return cost_; }

  bool solve(double mu) {
    PoseMatrix damped = curvature_;
    damped.diagonal() *= 1 + mu;
    const PoseVector step = damped.ldlt().solve(slope_);
    next_ = moved(state_, step, centre_);
    next_.joints = next_.joints.cwiseMax(fit_.least_).cwiseMin(fit_.most_);
    next_cost_ = fit_.cost(next_, given_);
    predicted_ = step.dot(2 * slope_ - curvature_ * step);
    return true;
  }

  bool lowers_cost() const { return next_cost_ < cost_; }

  double accept() {
    fall_ = cost_ - next_cost_;
    cost_ = next_cost_;
    state_ = next_;
    linearise();
    return fall_ / predicted_;
  }

  bool rests() const { return fall_ < kSmall * cost_; }
  Refusal refuse() const { return predicted_ < kSmall * cost_ ? Refusal::kAtRest : Refusal::kDamp; }

 private:
  static constexpr double kSmall = 1e-7;  // of the cost, by which a step must lower it to be followed by another

  void linearise() {
    const Rows rows = fit_.derivatives(state_, centre_) / kScale;
    const JointPoints off = (given_ - fit_.joints(state_)) / kScale;
    slope_ = rows.transpose() * off.reshaped();
    curvature_ = rows.transpose() * rows;
    slope_.tail<21>() -= state_.joints - fit_.prior_;
    curvature_.diagonal().tail<21>().array() += 1.0;
    for (Eigen::Index q = 0; q < 21; ++q) {  // joints at an end of their range that would leave it stay
      const Eigen::Index k = kPlaceUnknowns + q;
      if ((state_.joints(q) <= fit_.least_(q) && slope_(k) < 0) ||
          (state_.joints(q) >= fit_.most_(q) && slope_(k) > 0)) {
        slope_(k) = 0;
        curvature_.row(k).setZero();
        curvature_.col(k).setZero();
        curvature_(k, k) = 1;
      }
    }
  }

  const JointFit& fit_;
  const JointPoints& given_;
  Vector3 centre_;
  HandState state_, next_;
  PoseMatrix curvature_;  // half of the second derivative
  PoseVector slope_;      // half of the first, downwards
  double cost_ = 0, next_cost_ = 0;
  double fall_ = 0, predicted_ = 0;  // of the cost
};

JointFitResult JointFit::fit(const JointPoints& given) const {
  JointFitResult best;
  double least = std::numeric_limits<double>::infinity();
  for (const JointAngles& start :
       {prior_, joint_angles(hand_pose("flat")), joint_angles(hand_pose("grasp")), joint_angles(hand_pose("fist"))}) {
    const JointPoints own = joints_of(skeleton(start), side_);
    const Eigen::Matrix4d rigid = Eigen::umeyama(own(Eigen::all, kPalm), given(Eigen::all, kPalm), false);
    const HandState first{{rigid.topLeftCorner<3, 3>(), rigid.topRightCorner<3, 1>()}, start};
    Descent descent(*this, given, first);
    MadsenDamping damping(kFirstDamping);
    for (int i = 0; i < kSteps && try_step(descent, damping) == PhaseStatus::kIterationLimit; ++i) {
    }
    if (descent.cost() < least) {
      least = descent.cost();
      best = {descent.state(), residual(descent.state(), given)};
    }
  }
  return best;
}

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
  const double reach = median(std::move(reaches));
  require(reach >= kLeastReach && reach <= kMostReach,
          "{}: its hand is {:.0f} mm long from the wrist to the middle fingertip, must be {:g} to {:g}: lengths are in "
          "m; another unit ends the names of a file's columns, as index_tip_x_mm",
          source, reach / kMillimetre, kLeastReach / kMillimetre, kMostReach / kMillimetre);
  const HandShape& hand = skin_.hand().hand();
  const HandProportions by = joint_proportions(hand, frames);
  require(by.allFinite(), "{}: wrist and knuckles are not arranged as in a hand: are columns exchanged?", source);
  fit_.emplace(hand, by);
  const double off = rms_off(*fit_, frames);
  HandShape other = hand;
  other.side = other_side(hand.side);
  if (const double its = rms_off(JointFit(other, by), frames); its < 0.8 * off && off > kMillimetre) {
    throw InputError(fmt::format(
        "{0}: the joints are the mirror image of a {1} hand ({2:.1f} mm rms off its skeleton, {3:.1f} off a {4} "
        "hand's). If it is a {1} hand, two axes are exchanged or one is reversed, as in Unity: put the columns right, "
        "which motion.sensor.joints.pose cannot. If it is a {4} hand, the hand that is fitted must have side: {4}",
        source, side_name(hand.side), off / kMillimetre, its / kMillimetre, side_name(other.side)));
  }
  shape_ = skin_.hand().shaped(by);
  return fmt::format(
      "joints: before the clock starts the lengths of the hand's bones were learnt from {} frames; it is {:.1f} mm "
      "long from the wrist to the middle fingertip and {:.1f} mm broad across the knuckles",
      frames.size(), reach / kMillimetre, hand.breadth * std::exp(by(kBreadthRatio)) / kMillimetre);
}

namespace {

/// Where no transducer can press on a hand with these joints; empty where some can.
std::string unreachable(const TransducerArray& array, const JointPoints& joints) {
  constexpr double kFar = 0.7;               // [m]
  constexpr double kWidths = 2;              // of the array, if that is farther: a focus is two wavelengths wide there
  constexpr std::ptrdiff_t kMostJoints = 4;  // behind an array: a finger over its edge
  if (array.kind == TransducerArray::Kind::kPlaneWave) {
    return "";
  }
  const auto behind = std::ranges::count_if(
      joints.colwise(), [&](const Vector3& joint) { return 2 * count_behind(array, joint) > array.size(); });
  if (behind > kMostJoints) {
    return fmt::format("behind the array, which radiates away from {} of its {} joints", behind, kTrackedJoints);
  }
  double distance = std::numeric_limits<double>::infinity();
  for (const Vector3& joint : joints.colwise()) {
    distance = std::min(distance, (array.positions.colwise() - joint).colwise().norm().minCoeff());
  }
  const double width = (array.positions.rowwise().maxCoeff() - array.positions.rowwise().minCoeff()).maxCoeff();
  const double most = std::max(kFar, kWidths * width);
  return distance > most ? fmt::format("{:.2f} m away from the array, must be within {:.2f} m", distance, most) : "";
}

}  // namespace

JointsHand::Frame JointsHand::fitted(const std::optional<JointPoints>& joints) const {
  if (!joints) {
    return {};
  }
  const JointFitResult fit = fit_->fit(*joints);
  Frame frame{fit.residual <= kMostOff ? Fault::kNone : Fault::kOff, fit.residual, fit.state, *joints, {}};
  const JointAngles& free = skin_.hand().free_joints();
  frame.state.joints = free.select(fit.state.joints, joint_angles(skin_.hand().pose()));
  if (frame.fault == Fault::kNone && fit_->residual(frame.state, *joints) > kMostHeld) {
    frame.fault = Fault::kHeld;
  }
  frame.place = frame.fault == Fault::kNone ? misplaced(frame.state) : "";
  frame.fault = frame.place.empty() ? frame.fault : Fault::kPlace;
  return frame;
}

/// Of the whole hand; none where its skin is no surface, which is lost anyway.
std::optional<ArrayContact> JointsHand::contact_of(const HandState& state) const {
  const FixedModel& model = *solved().first().fixed;
  Points skin;
  skin_.hand().carry(shape_, fit_->skeleton(state.joints), skin);
  try {
    return array_contact(model.scene.array, model.array, {state.place(skin), skin_.hand().mesh().triangles()});
  } catch (const InputError&) {
    return {};
  }
}

std::string JointsHand::misplaced(const HandState& state) const {
  const FixedModel& model = *solved().first().fixed;
  const JointPoints joints = fit_->joints(state);
  std::string fault;
  if (const auto contact = contact_of(state)) {
    fault = contact->board ? fmt::format("through the board of array unit {} at {}", contact->board->plate,
                                         place_text(contact->board->at))
                           : fmt::format("in the array, about transducer {} at {}", contact->transducer,
                                         place_text(model.array.positions.col(contact->transducer)));
  } else {
    fault = unreachable(model.array, joints);
  }
  if (fault.empty()) {
    return "";
  }
  return fmt::format(
      "the tracked hand is {}: its wrist is at {}, its middle fingertip at {}. motion.sensor.joints.pose must turn the "
      "tracker's axes to those of the scene and move its origin, which must not be in the hand",
      fault, place_text(joints.col(0)), place_text(joints.col(kMiddleTip)));
}

Seen JointsHand::seen(double seconds, const Frame& frame) const {
  Seen seen = frame.fault != Fault::kNone
                  ? skin_.lost(seconds)
                  : skin_.seen(seconds, [&](const HandTemplate::Carrier& carrier, Points& world) {
                      skin_.hand().carry(shape_, fit_->skeleton(frame.state.joints), carrier, world);
                      world = frame.state.place(world);
                    });
  const JointPoints joints = frame.joints.value_or(JointPoints::Constant(kNotComputed));
  seen.joints.assign(joints.colwise().begin(), joints.colwise().end());
  return seen;
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
    const Seen place = seen(0, *good[static_cast<std::size_t>(std::lround(evenly(last, i, count)))]);
    if (!place.lost) {
      meshes.emplace_back(*place.state.skin, solved().first().body.mesh.triangles());
    }
  }
  if (meshes.empty()) {
    meshes.push_back(solved().first().body.mesh);
  }
  return meshes;
}

void MisplacedHands::add(const JointsHand::Frame& frame, double seconds) {
  ++frames_;
  placed_ = placed_ || frame.fault == JointsHand::Fault::kNone;
  if (frame.fault == JointsHand::Fault::kPlace && ++misplaced_ == 1) {
    first_ = fmt::format("at {:.2f} s {}", seconds, frame.place);
  }
}

void MisplacedHands::require_some_placed(const std::string& source) const {
  require(placed_ || misplaced_ == 0, "{}: {}", source, first_);
}

std::vector<std::string> MisplacedHands::warnings() const {
  if (misplaced_ == 0) {
    return {};
  }
  return {
      fmt::format("misplaced: {} of {} samples count as lost, and nothing sounds: {}", misplaced_, frames_, first_)};
}

}  // namespace touchfield
