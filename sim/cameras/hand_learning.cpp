#include <cmath>

#include <Eigen/SparseCholesky>

#include "sim/cameras/hand_tracker.h"
#include "sim/core/units.h"
#include "sim/mesh/topology.h"

namespace touchfield {

namespace {

constexpr Eigen::Index kProportions = HandProportions::SizeAtCompileTime;
using ProportionMatrix = Eigen::Matrix<double, kProportions, kProportions>;
using MixedMatrix = Eigen::Matrix<double, kPoseUnknowns, kProportions>;

constexpr std::size_t kLearningFrames = 12;
constexpr std::size_t kLeastLearningFrames = 3;
constexpr std::size_t kLearningViews = 3;       // of these, of which digits are learnt
constexpr double kLearningTurn = 20 * kDegree;  // deviation of joints from where they are
constexpr double kFirstLearningReach = 12e-3;   // reach of the first round [m]
constexpr double kLearningReach = 5e-3;
constexpr double kLearningScale = 2e-3;

/// What a hand that the template cannot make leaves is alike over a patch of skin and in all frames, so that more
/// points say no more of it. With noise of variance n per point, M points and P patches that differ by a variance s
/// besides,
///
///   information per point = 1 / (n (1 + s M / (n P)))
class Misfit {
 public:
  void add(const HandPoints& points, const std::vector<SkinMatch>& matches) {
    for (const SkinMatch& match : matches) {
      const double sigma = points.sigma(match.point);
      squares_ += match.weight * match.residual * match.residual;
      noise_ += match.weight * sigma * sigma;
    }
    count_ += static_cast<double>(matches.size());
  }

  /// That share of the points' own weight.
  double share() const {
    constexpr double kPatches = 200;  // of 10 mm x 10 mm: half the skin of a hand
    const double model = std::max(0.0, squares_ - noise_);
    return noise_ > 0 ? 1 / (1 + model / noise_ * count_ / kPatches) : 1;
  }

 private:
  double squares_ = 0;  // weighted
  double noise_ = 0;    // likewise, of the points' own
  double count_ = 0;
};

/// The sum of squares of one frame about its pose and the proportions.
struct FrameSystem {
  PoseMatrix pose = PoseMatrix::Zero();
  MixedMatrix mixed = MixedMatrix::Zero();
  ProportionMatrix shape = ProportionMatrix::Zero();
  PoseVector pose_slope = PoseVector::Zero();
  HandProportions shape_slope = HandProportions::Zero();
};

/// Where the vertices go when each of the proportions grows, divided by that growth; in the world's frame.
std::vector<Points> derivatives_by_proportion(const HandTemplate& hand, const ShapedHand& shape,
                                              const HandState& state) {
  constexpr double kStep = 1e-5;
  Points before;
  hand.carry(shape, hand.skeleton_at(shape.proportions, state.joints), before);
  std::vector<Points> result(static_cast<std::size_t>(kProportions));
  for (Eigen::Index k = 0; k < kProportions; ++k) {
    HandProportions grown = shape.proportions;
    grown(k) += kStep;
    Points& points = result[static_cast<std::size_t>(k)];
    hand.carry(hand.shaped(grown, shape.offset), hand.skeleton_at(grown, state.joints), points);
    points = state.place.rotation * (points - before) / kStep;
  }
  return result;
}

FrameSystem frame_system(const HandTemplate& hand, const ShapedHand& shape, const HandState& state,
                         const PosePrior& prior, const PoseFit& fit) {
  const std::vector<Points> growth = derivatives_by_proportion(hand, shape, state);
  FrameSystem system;
  for (std::size_t m = 0; m < fit.matches().size(); ++m) {
    const SkinMatch& match = fit.matches()[m];
    const auto face = hand.mesh().triangles().col(match.face);
    HandProportions by_shape;
    for (Eigen::Index k = 0; k < kProportions; ++k) {
      by_shape(k) = match.normal.dot(growth[static_cast<std::size_t>(k)](Eigen::all, face) * match.weights);
    }
    const PoseVector by_pose = fit.rows().col(static_cast<Eigen::Index>(m));
    system.pose += match.weight * by_pose * by_pose.transpose();
    system.mixed += match.weight * by_pose * by_shape.transpose();
    system.shape += match.weight * by_shape * by_shape.transpose();
    system.pose_slope += match.weight * match.residual * by_pose;
    system.shape_slope += match.weight * match.residual * by_shape;
  }
  system.pose.diagonal().head<kPlaceUnknowns>().array() += 1;
  const JointAngles stiffness = prior.deviation.array().square().inverse();
  system.pose.diagonal().tail<JointAngles::SizeAtCompileTime>() += stiffness;
  system.pose_slope.tail<JointAngles::SizeAtCompileTime>() += stiffness.cwiseProduct(prior.joints - state.joints);
  return system;
}

ShapedHand proportions_step(const HandTemplate& hand, const ShapedHand& shape, const std::vector<HandPoints>& frames,
                            std::vector<HandState>& states, const std::optional<PosePrior>& prior, double reach,
                            const HandProportions& expected, const HandProportions& deviation, PoseFit& fit) {
  std::vector<FrameSystem> systems;
  std::vector<Vector3> centres;
  Misfit misfit;
  ProportionMatrix curvature = ProportionMatrix::Zero();
  HandProportions slope = HandProportions::Zero();
  const double scale = std::max(fit.robust_scale(), reach / 3);
  for (std::size_t f = 0; f < frames.size(); ++f) {
    centres.emplace_back(frames[f].at.rowwise().mean());
    fit.match(shape, frames[f], states[f], reach, scale);
    fit.differentiate(shape, states[f], centres.back());
    const PosePrior free{states[f].joints, JointAngles::Constant(kLearningTurn)};
    const FrameSystem& system = systems.emplace_back(frame_system(hand, shape, states[f], prior.value_or(free), fit));
    const MixedMatrix solved = system.pose.ldlt().solve(system.mixed);
    curvature += system.shape - system.mixed.transpose() * solved;
    slope += system.shape_slope - solved.transpose() * system.pose_slope;
    misfit.add(frames[f], fit.matches());
  }
  const HandProportions stiffness = deviation.cwiseAbs2().cwiseInverse() / misfit.share();
  curvature.diagonal() += stiffness;
  slope -= stiffness.cwiseProduct(shape.proportions - expected);
  const HandProportions step = curvature.ldlt().solve(slope).cwiseMax(-0.1).cwiseMin(0.1);
  for (std::size_t f = 0; f < frames.size(); ++f) {
    PoseVector turn = systems[f].pose.ldlt().solve(systems[f].pose_slope - systems[f].mixed * step);
    turn.tail<JointAngles::SizeAtCompileTime>().array() *= hand.free_joints().array();
    states[f] = moved(states[f], turn, centres[f]);
  }
  return hand.shaped(shape.proportions + step, shape.offset);
}

/// The shape with the proportions that fit best together with the poses, from coarse to fine.
///
/// prior   of the joints; without it they are free
ShapedHand fitted_proportions(const HandTemplate& hand, ShapedHand shape, const std::vector<HandPoints>& frames,
                              std::vector<HandState>& states, const std::optional<PosePrior>& prior,
                              const LearningOptions& options, int rounds, PoseFit& fit) {
  HandProportions deviation = HandProportions::Constant(options.part);
  deviation.head<2>().setConstant(options.size);
  HandProportions expected = HandProportions::Zero();
  expected.tail<5>() = shape.proportions.tail<5>();  // found by what is seen: distances say little of them
  for (int round = 0; round < rounds; ++round) {
    const double reach = std::max(kLearningReach, kFirstLearningReach * std::pow(0.7, round));
    shape = proportions_step(hand, shape, frames, states, prior, reach, expected, deviation, fit);
  }
  return shape;
}

/// What holds the offset: its size and its roughness.
Eigen::SparseMatrix<double> offset_prior(const HandTemplate& hand, const LearningOptions& options) {
  const Eigen::Index count = hand.mesh().vertex_count();
  const EdgeTable edges = edge_table(hand.mesh().triangles());
  Eigen::VectorXd degree = Eigen::VectorXd::Zero(count);
  for (const int v : edges.ends.reshaped()) {
    degree(v) += 1;
  }
  std::vector<Eigen::Triplet<double>> entries;
  for (Eigen::Index v = 0; v < count; ++v) {
    entries.emplace_back(static_cast<int>(v), static_cast<int>(v), 1.0);
  }
  for (const auto& ends : edges.ends.colwise()) {
    entries.emplace_back(ends(0), ends(1), -1 / degree(ends(0)));
    entries.emplace_back(ends(1), ends(0), -1 / degree(ends(1)));
  }
  Eigen::SparseMatrix<double> bend(count, count);
  bend.setFromTriplets(entries.begin(), entries.end());
  Eigen::SparseMatrix<double> result = bend.transpose() * bend / (options.roughness * options.roughness);
  for (Eigen::Index v = 0; v < count; ++v) {
    result.coeffRef(v, v) += 1 / (options.offset * options.offset);
  }
  return result;
}

/// The offset that fits best with the poses as they are.
ShapedHand offset_step(const HandTemplate& hand, const ShapedHand& shape, const std::vector<HandPoints>& frames,
                       const std::vector<HandState>& states, const Eigen::SparseMatrix<double>& prior, PoseFit& fit) {
  std::vector<Eigen::Triplet<double>> entries;
  Eigen::VectorXd slope = Eigen::VectorXd::Zero(shape.offset.size());
  for (std::size_t f = 0; f < frames.size(); ++f) {
    fit.match(shape, frames[f], states[f], kLearningReach, kLearningScale);
    for (const SkinMatch& match : fit.matches()) {
      const auto face = hand.mesh().triangles().col(match.face);
      const double wanted = match.residual + match.weights.dot(shape.offset(face));
      for (int c = 0; c < 3; ++c) {
        slope(face(c)) += match.weight * match.weights(c) * wanted;
        for (int d = 0; d < 3; ++d) {
          entries.emplace_back(face(c), face(d), match.weight * match.weights(c) * match.weights(d));
        }
      }
    }
  }
  Eigen::SparseMatrix<double> matrix(slope.size(), slope.size());
  matrix.setFromTriplets(entries.begin(), entries.end());
  matrix += prior;
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver(matrix);
  return hand.shaped(shape.proportions, solver.solve(slope));
}

/// Learns the shape of a hand from what was seen of it in several poses.
///
/// First the proportions and the poses of all frames are fitted together. This is Gauss-Newton on PoseFit's sum over
/// the frames and sum_k (b_k / deviation_k)^2. The poses are eliminated frame by frame. Where the template cannot make
/// the hand, the points lie farther off it than their noise. The same places do so in all frames, so that the points
/// weigh less against what is expected. Then the offset o of the vertices along their normals is fitted, and the poses
/// again:
///
///   sum_frames sum_i w_i (r_i - sum_c b_ic o_c)^2 + sum_v (o_v / offset)^2 + sum_v ((o_v - mean_round o) /
///   roughness)^2
///
/// The matrix of this sum is sparse (Cholesky). The offset of skin that is not seen follows smoothly that of the skin
/// next to it and falls to 0.
///
/// start    shape to start from
/// frames   points of each; one or more
/// states   of the hand in each, near enough for matches within 15 mm; improved
ShapedHand learnt_shape(const HandTemplate& hand, const ShapedHand& start, const std::vector<HandPoints>& frames,
                        std::vector<HandState>& states, const LearningOptions& options) {
  PoseFit fit(hand);
  ShapedHand shape = fitted_proportions(hand, start, frames, states, {}, options, options.rounds, fit);
  const Eigen::SparseMatrix<double> prior = offset_prior(hand, options);
  for (int round = 0; round < options.offset_rounds; ++round) {
    shape = offset_step(hand, shape, frames, states, prior, fit);
    for (std::size_t f = 0; f < frames.size(); ++f) {
      const PosePrior near{states[f].joints, JointAngles::Constant(kLearningTurn)};
      states[f] =
          fit.fit(shape, frames[f], states[f], near, {3, kLearningReach, kLearningReach, kLearningScale, 1, false})
              .state;
    }
  }
  return shape;
}

}  // namespace

/// Bends digits that are not seen where the attempt has them, half bends them, turns them to a side, or makes them
/// shorter, if that is seen.
void HandTracker::with_digits_moved(const DepthFrame& frame, Attempt& attempt) {
  constexpr double kAside = 14;
  constexpr double kShorter = 0.08;  // of the ratio's logarithm
  constexpr double kShortest = -0.25;
  const std::array<Eigen::Vector4d, 4> moves = {Eigen::Vector4d(0, 80, 95, 50), Eigen::Vector4d(0, 40, 50, 30),
                                                Eigen::Vector4d(kAside, 0, 0, 0), Eigen::Vector4d(-kAside, 0, 0, 0)};
  for (std::size_t tries = 0; attempt.fit.digits_off > 0 && tries < 2 * HandSkeleton::kDigits; ++tries) {
    shape_ = attempt.shape;
    evaluate(frame, attempt.points, attempt.fit);  // for digits_missing()
    const Attempt before = attempt;
    const auto follow = [&](const HandState& start, const PosePrior& prior) {
      HandFit other = fitted(frame, attempt.points, start, prior);
      if (other.worth() > attempt.fit.worth()) {
        attempt.fit = std::move(other);
        attempt.shape = shape_;
        attempt.prior = prior;
      }
    };
    for (const std::size_t digit : digits_missing()) {
      const Eigen::Index first = first_joint(digit);
      HandProportions by = before.shape.proportions;
      double& length = by(kDigitRatios + static_cast<Eigen::Index>(digit));
      length -= kShorter;
      if (!learnt_ && length >= kShortest) {
        shape_ = hand_->shaped(by);
        follow(before.fit.state, before.prior);
        shape_ = before.shape;
      }
      HandState start = before.fit.state;
      PosePrior prior = before.prior;
      if (digit == 0) {
        prior.joints.head<5>() = start.joints.head<5>() = joint_angles(hand_pose("index_up")).head<5>();
        follow(start, prior);
        continue;
      }
      for (const Eigen::Vector4d& move : moves) {
        start.joints = before.fit.state.joints;
        if (move(0) != 0) {
          start.joints(first) += move(0) * kDegree;
        } else {
          start.joints.segment<3>(first + 1) = move.tail<3>() * kDegree;
        }
        prior.joints.segment<4>(first) = start.joints.segment<4>(first);
        follow(start, prior);
      }
    }
    if (!(attempt.fit.worth() > before.fit.worth())) {
      break;
    }
  }
}

/// Takes the proportions that fit the frame best, where they explain more.
///
/// model_error   that the fit goes down to [m]
void HandTracker::with_proportions(const DepthFrame& frame, Attempt& attempt, double model_error) {
  constexpr int kRounds = 6;
  if (learnt_) {
    return;
  }
  const double expected = fit_.model_error();
  fit_.expect_model_error(model_error);
  HandFit other = attempt.fit;
  std::vector<HandState> states{other.state};
  shape_ = fitted_proportions(*hand_, attempt.shape, {attempt.points}, states, attempt.prior, options_.learning,
                              kRounds, fit_);
  other.state = fit_.fit(shape_, attempt.points, states.front(), attempt.prior,
                         {options_.rounds, kLearningReach, kLearningReach, fit_.robust_scale(), 1, false})
                    .state;
  fit_.expect_model_error(expected);
  evaluate(frame, attempt.points, other);
  if (other.worth() > attempt.fit.worth()) {
    attempt.fit = std::move(other);
    attempt.shape = shape_;
  }
}

/// Digits longer or shorter, where that explains more of the frames: what a camera looks past speaks against skin that
/// is not there, and distances of points say nothing of it. Sets shape_.
void HandTracker::learn_digits(std::vector<LearningView>& views) {
  constexpr double kStep = 0.06;  // of the ratio's logarithm
  constexpr double kMost = 0.35;
  constexpr double kGain = 1.002;
  const auto worth = [&] {
    double sum = 0;
    for (LearningView& view : views) {
      view.fit =
          fitted(view.frame, view.points, view.fit.state, {view.fit.state.joints, JointAngles::Constant(kStartTurn)});
      sum += view.fit.explained_area();
    }
    return sum;
  };
  double best = worth();
  for (Eigen::Index digit = 0; digit < static_cast<Eigen::Index>(HandSkeleton::kDigits); ++digit) {
    for (const double step : {-kStep, kStep}) {
      bool better = true;
      while (better && std::abs(shape_.proportions(kDigitRatios + digit) + step) <= kMost) {
        const ShapedHand shape = shape_;
        std::vector<HandFit> before;
        std::ranges::transform(views, std::back_inserter(before), &LearningView::fit);
        HandProportions by = shape_.proportions;
        by(kDigitRatios + digit) += step;
        shape_ = hand_->shaped(by, shape.offset);
        const double other = worth();
        better = other > kGain * best;
        if (better) {
          best = other;
        } else {
          shape_ = shape;
          for (std::size_t i = 0; i < views.size(); ++i) {
            views[i].fit = before[i];
          }
        }
      }
    }
  }
}

bool HandTracker::learn(std::size_t count, const std::function<DepthFrame(std::size_t)>& frame) {
  learning_ = true;
  std::vector<HandPoints> points;
  std::vector<HandState> states;
  std::vector<std::size_t> numbers;  // of their frames
  for (std::size_t k = 0; k < count; ++k) {
    HandPoints of_frame;
    const HandFit fit = track_points(frame(k), of_frame);
    if (!fit.lost) {
      points.push_back(std::move(of_frame));
      states.push_back(fit.state);
      numbers.push_back(k);
    }
  }
  learning_ = false;
  if (states.size() < kLeastLearningFrames) {
    return false;
  }
  const std::size_t taken = std::min(states.size(), kLearningFrames);
  std::vector<HandPoints> chosen_points;
  std::vector<HandState> chosen_states;
  for (std::size_t i = 0; i < taken; ++i) {
    const std::size_t from = (i * (states.size() - 1)) / std::max<std::size_t>(taken - 1, 1);
    chosen_points.push_back(std::move(points[from]));
    chosen_states.push_back(states[from]);
  }
  learnt_ = true;
  fit_.expect_model_error(kKnownSkinError);
  shape_ = fitted_proportions(*hand_, shape_, chosen_points, chosen_states, {}, options_.learning,
                              options_.learning.rounds, fit_);
  const std::size_t step = (taken + kLearningViews - 1) / kLearningViews;
  std::vector<LearningView> views;
  for (std::size_t i = 0; i < taken; i += step) {
    LearningView& view = views.emplace_back();
    view.frame = frame(numbers[(i * (states.size() - 1)) / std::max<std::size_t>(taken - 1, 1)]);
    view.points = chosen_points[i];
    view.fit.state = chosen_states[i];
  }
  learn_digits(views);
  shape_ = learnt_shape(*hand_, shape_, chosen_points, chosen_states, options_.learning);
  for (std::size_t i = 0; i < views.size(); ++i) {
    views[i].fit.state = chosen_states[i * step];
  }
  learn_digits(views);
  double misfit = 0;
  for (const LearningView& view : views) {
    misfit +=
        (view.fit.residual * view.fit.residual - view.fit.noise * view.fit.noise) / static_cast<double>(views.size());
  }
  fit_.expect_model_error(std::clamp(std::sqrt(std::max(misfit, 0.0)), kKnownSkinError, kUnknownSkinError));
  look_for(shape_, {1.0});
  shifts_.resize(3, 0);
  if (!past_.empty()) {
    past_ = {{past_.back().seconds, chosen_states.back()}};
  }
  return true;
}

}  // namespace touchfield
