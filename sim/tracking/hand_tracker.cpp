#include "sim/tracking/hand_tracker.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <numeric>
#include <utility>

#include <Eigen/Geometry>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include "sim/core/units.h"

namespace touchfield {

namespace {

constexpr double kFollowReach = 8e-3;        // from the predicted skin [m]
constexpr double kFollowScale = 2e-3;        // [m]
constexpr double kFollowTurn = 6 * kDegree;  // deviation of joints from what is predicted
constexpr double kRegionMargin = 40e-3;      // round the hand where points are looked for [m]
constexpr double kNear = 12e-3;              // points count as near the skin [m]
constexpr double kBehindWrist = -5e-3;       // y in the hand's frame [m]
constexpr double kSightTolerance = 7e-3;     // [m]
constexpr Eigen::Index kLeastFitPoints = 150;
constexpr std::size_t kLearningFrames = 12;
constexpr std::size_t kLeastLearningFrames = 3;
constexpr std::size_t kStartsPerFrame = 2;
constexpr Eigen::Index kPointsOfStart = 500;
constexpr double kStartTurn = 15 * kDegree;  // deviation of joints from the template's

class Stopwatch {
 public:
  explicit Stopwatch(double& seconds) : seconds_(seconds) {}
  ~Stopwatch() { seconds_ += std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count(); }
  Stopwatch(const Stopwatch&) = delete;
  Stopwatch& operator=(const Stopwatch&) = delete;

 private:
  double& seconds_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

Box box_round(const Points& points, double margin) {
  const Vector3 more = Vector3::Constant(margin);
  return {Vector3(points.rowwise().minCoeff() - more), Vector3(points.rowwise().maxCoeff() + more)};
}

}  // namespace

std::string lost_text(const HandFit& fit) {
  if (!fit.lost) {
    return {};
  }
  const int points = std::accumulate(fit.points.begin(), fit.points.end(), 0);
  if (points < kLeastFitPoints) {
    return fmt::format("points where the hand is looked for {} ({} asked)", points, kLeastFitPoints);
  }
  if (!fit.placed) {
    return "nothing as large as a hand";
  }
  std::vector<std::string> reasons;
  const auto require = [&](bool good, const std::string& reason) {
    if (!good) {
      reasons.push_back(reason);
    }
  };
  require(fit.near >= kLeastFitPoints, fmt::format("points near the skin {} ({} asked)", fit.near, kLeastFitPoints));
  require(fit.share >= fit.asked.share, fmt::format("share {:.3f} ({:g} asked)", fit.share, fit.asked.share));
  require(fit.explained >= fit.asked.explained,
          fmt::format("explained {:.3f} ({:g} asked)", fit.explained, fit.asked.explained));
  require(fit.residual <= fit.asked.residual,
          fmt::format("residual {:.2f} mm ({:g} asked)", fit.residual / kMillimetre, fit.asked.residual / kMillimetre));
  require(fit.digits, "a digit's end is not where it is fitted");
  return fmt::format("{}", fmt::join(reasons, "; "));
}

PoseVector HandFit::pose() const {
  const Eigen::AngleAxisd turn(state.place.rotation);
  PoseVector row;
  row << turn.angle() * turn.axis(), state.place.shift, state.joints;
  return row;
}

HandTracker::HandTracker(const HandTemplate& hand, std::vector<DepthCamera> cameras, const Box& workspace,
                         const FitOptions& options)
    : hand_(std::make_shared<const HandTemplate>(hand)),
      reader_(std::move(cameras), options.points),
      workspace_(workspace),
      options_(options),
      shape_(hand_->shaped(HandProportions::Zero())),
      fit_(*hand_),
      search_({hand_->mesh()}) {
  for (Eigen::Index v = 0; v < hand_->mesh().vertex_count(); ++v) {
    const std::size_t bone = hand_->influences(v).front().bone;
    const bool end = bone != SkinnedHand::kPalm && bone != SkinnedHand::kSwing && (bone - 1) % 3 > 0;
    digit_.push_back(end ? static_cast<int>((bone - 1) / 3) : -1);
  }
  if (options.node_spacing > 0) {
    deformation_.emplace(DeformationGraph(hand_->mesh(), options.node_spacing));
  }
}

void HandTracker::forget() {
  past_.clear();
  starts_.clear();
  shifts_.resize(3, 0);
}

HandState HandTracker::predicted(double seconds) const {
  const Past& last = past_.back();
  if (past_.size() < 2) {
    return last.state;
  }
  const Past& before = past_.front();
  constexpr double kPlaceKept = 0.8;
  constexpr double kJointsKept = 0.5;
  const double between = last.seconds - before.seconds;
  const double ahead = between > 0 ? std::clamp((seconds - last.seconds) / between, 0.0, 2.0) : 0.0;
  const Eigen::AngleAxisd turn(last.state.place.rotation * before.state.place.rotation.transpose());
  HandState state = last.state;
  state.place.rotation =
      Eigen::AngleAxisd(kPlaceKept * ahead * turn.angle(), turn.axis()).toRotationMatrix() * last.state.place.rotation;
  // The middle of the palm moves on, not the wrist that the place is about.
  const Vector3 middle(0, 0.2 * hand_->hand().length, 0);
  const Vector3 now = last.state.place(middle);
  state.place.shift = now + kPlaceKept * ahead * (now - before.state.place(middle)) - state.place.rotation * middle;
  state.joints += kJointsKept * ahead * (last.state.joints - before.state.joints);
  return state;
}

Box HandTracker::region(const HandState& state) const {
  Points vertices;
  hand_->carry(shape_, hand_->skeleton_at(shape_.proportions, state.joints), vertices);
  return box_round(state.place(vertices), kRegionMargin).intersection(workspace_);
}

/// Whether the ends of all digits are where the images can have them.
bool HandTracker::digits_confirmed(double least) const {
  constexpr double kLeastSaid = 12;
  std::array<double, HandSkeleton::kDigits> confirmed{};
  std::array<double, HandSkeleton::kDigits> said{};
  for (std::size_t v = 0; v < digit_.size(); ++v) {
    if (digit_[v] >= 0) {
      const auto d = static_cast<std::size_t>(digit_[v]);
      const auto vertex = static_cast<Eigen::Index>(v);
      confirmed[d] += check_.confirmed(vertex);
      said[d] += check_.confirmed(vertex) + check_.refuted(vertex);
    }
  }
  for (std::size_t d = 0; d < said.size(); ++d) {
    if (said[d] >= kLeastSaid && confirmed[d] < least * said[d]) {
      return false;
    }
  }
  return true;
}

/// Whether a fit is to be believed. Leaves the skin's matches in fit_.
void HandTracker::judge(const DepthFrame& frame, const HandPoints& points, const FitBelief& belief, HandFit& fit) {
  constexpr double kOfDigits = 0.6;
  const Stopwatch watch(times_.check);
  fit_.match(shape_, points, fit.state, kNear, kFollowScale);
  const Eigen::Matrix3d back = fit.state.place.rotation.transpose();
  double near = 0;
  double explained = 0;
  double squares = 0;
  double weights = 0;
  for (const SkinMatch& match : fit_.matches()) {
    if ((back * (points.at.col(match.point) - fit.state.place.shift)).y() > kBehindWrist) {
      near += 1;
      explained += std::abs(match.residual) < belief.within ? 1 : 0;
    }
    squares += match.weight * match.residual * match.residual;
    weights += match.weight;
  }
  check_sight(cameras(), frame, fit_.vertices(), fit_.normals(), kSightTolerance, options_.points.baseline, check_);
  fit.placed = true;
  fit.asked = belief;
  fit.near = static_cast<Eigen::Index>(near);
  fit.confirmed = check_.confirmed_by;
  fit.digits = digits_confirmed(kOfDigits * belief.share);
  const TriangleMesh& mesh = hand_->mesh();
  fit.seen_vertex = check_.confirmed.cwiseMin(1.0);
  fit.seen = confidence(fit).dot(mesh.areas()) / mesh.total_area();
  fit.explained = explained / std::max(near, 1.0);
  fit.share = check_.share();
  fit.residual = weights > 0 ? std::sqrt(squares / weights) : 0;
  fit.lost = !(fit.near >= kLeastFitPoints && fit.explained >= belief.explained && fit.share >= belief.share &&
               fit.residual <= belief.residual && fit.digits);
}

/// freedom   deviation of the joints from where they start [rad]
HandFit HandTracker::fitted(const DepthFrame& frame, const HandPoints& points, const HandState& start, double freedom,
                            const FitBelief& belief) {
  HandFit fit;
  fit.seconds = frame.seconds;
  fit.state = start;
  if (points.size() < kLeastFitPoints) {
    return fit;
  }
  {
    const Stopwatch watch(times_.pose);
    const PosePrior prior{start.joints, JointAngles::Constant(freedom)};
    const double reach = learning_ ? 2 * kFollowReach : kFollowReach;
    fit.state =
        fit_.fit(shape_, points, start, prior, {options_.rounds, reach, kFollowReach, kFollowScale, 1, false}).state;
  }
  judge(frame, points, learnt_ ? belief : options_.unlearnt, fit);
  return fit;
}

/// Brings a start that is some centimetres and tens of degrees off to where fitted() can take it up.
HandState HandTracker::brought_closer(const HandPoints& points, const HandStart& start) {
  const Stopwatch watch(times_.pose);
  const int stride = std::max(1, static_cast<int>(points.size() / kPointsOfStart));
  const JointAngles joints = joint_angles(hand_->pose());
  const PosePrior stiff{joints, JointAngles::Constant(kFollowTurn)};
  const HandState placed =
      fit_.fit(shape_, points, {start.place, joints}, stiff, {6, 24e-3, 12e-3, 4e-3, stride, true}).state;
  const PosePrior loose{joints, JointAngles::Constant(kStartTurn)};
  return fit_.fit(shape_, points, placed, loose, {8, 20e-3, 8e-3, 3e-3, stride, false}).state;
}

HandFit HandTracker::found(const DepthFrame& frame, const HandPoints& points) {
  HandFit fit;
  fit.seconds = frame.seconds;
  if (points.size() < kLeastFitPoints) {
    starts_.clear();
    return fit;
  }
  std::size_t most = kStartsPerFrame;
  if (starts_.empty()) {
    const Stopwatch watch(times_.search);
    starts_ = search_.starts(points, cameras(), frame);
    std::ranges::reverse(starts_);
    most = 1;
  }
  most = learning_ ? starts_.size() : std::min(most, starts_.size());
  for (std::size_t k = 0; k < most && fit.lost; ++k) {
    const HandState near = brought_closer(points, starts_.back());
    starts_.pop_back();
    HandFit other = fitted(frame, points, near, kStartTurn, options_.found);
    if (!other.lost || other.share + other.explained >= fit.share + fit.explained) {
      fit = std::move(other);
    }
  }
  return fit;
}

void HandTracker::deform(const HandPoints& points, HandFit& fit) {
  const Stopwatch watch(times_.deformation);
  const auto& matches = fit_.matches();
  const auto count = static_cast<Eigen::Index>(matches.size());
  targets_.skin.face.resize(matches.size());
  targets_.skin.weights.resize(3, count);
  targets_.at.resize(3, count);
  targets_.target.resize(3, count);
  targets_.normal.resize(3, count);
  targets_.weight.resize(count);
  for (Eigen::Index m = 0; m < count; ++m) {
    const SkinMatch& match = matches[static_cast<std::size_t>(m)];
    targets_.skin.face[static_cast<std::size_t>(m)] = match.face;
    targets_.skin.weights.col(m) = match.weights;
    targets_.target.col(m) = points.at.col(match.point);
    targets_.at.col(m) = points.at.col(match.point) - match.residual * match.normal;
    targets_.normal.col(m) = match.normal;
    const double damping = 1 / (1 + match.residual * match.residual / (kFollowScale * kFollowScale));
    targets_.weight(m) = damping * damping;
  }
  NodeMotions motions = deformation_->graph().motions(fit_.vertices(), shifts_);
  deformation_->fit(targets_, options_.deformation, shifts_, 1, motions);
  fit.deformation = DeformationGraph::shifts(motions);
  shifts_ = fit.deformation;
}

HandFit HandTracker::track_points(const DepthFrame& frame, HandPoints& points) {
  times_ = {};
  const bool following = !past_.empty();
  const HandState from = following ? predicted(frame.seconds) : HandState{};
  {
    const Stopwatch watch(times_.points);
    points = reader_.read(frame, following ? region(from) : workspace_);
  }
  HandFit fit = following ? fitted(frame, points, from, kFollowTurn, options_.followed) : found(frame, points);
  fit.points.assign(cameras().size(), 0);
  for (const int camera : points.camera) {
    ++fit.points[static_cast<std::size_t>(camera)];
  }
  if (fit.lost) {
    past_.clear();
    shifts_.resize(3, 0);
    return fit;
  }
  starts_.clear();
  if (past_.size() == 2) {
    past_.erase(past_.begin());
  }
  past_.push_back({frame.seconds, fit.state});
  return fit;
}

HandFit HandTracker::track(const DepthFrame& frame) {
  HandPoints points;
  HandFit fit = track_points(frame, points);
  if (!fit.lost && deformation_) {
    deform(points, fit);
  }
  return fit;
}

bool HandTracker::learn(std::size_t count, const std::function<DepthFrame(std::size_t)>& frame) {
  learning_ = true;
  std::vector<HandPoints> points;
  std::vector<HandState> states;
  for (std::size_t k = 0; k < count; ++k) {
    HandPoints of_frame;
    const HandFit fit = track_points(frame(k), of_frame);
    if (!fit.lost) {
      points.push_back(std::move(of_frame));
      states.push_back(fit.state);
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
  shape_ = learnt_shape(*hand_, shape_, chosen_points, chosen_states, options_.learning);
  shifts_.resize(3, 0);
  if (!past_.empty()) {
    past_ = {{past_.back().seconds, chosen_states.back()}};
  }
  return true;
}

NodeMotions HandTracker::motions(const HandFit& fit) const {
  Points vertices;
  hand_->carry(shape_, hand_->skeleton_at(shape_.proportions, fit.state.joints), vertices);
  return deformation_->graph().motions(fit.state.place(vertices), fit.deformation);
}

void HandTracker::skin(const HandFit& fit, const HandTemplate::Carrier& carrier, Points& world) const {
  hand_->carry(shape_, hand_->skeleton_at(shape_.proportions, fit.state.joints), carrier, world);
  world = fit.state.place(world);
  if (deformation_ && fit.deformation.cols() > 0) {
    deformation_->graph().apply(motions(fit), carrier.binding, world);
  }
}

void HandTracker::skin(const HandFit& fit, Points& world) const {
  hand_->carry(shape_, hand_->skeleton_at(shape_.proportions, fit.state.joints), world);
  world = fit.state.place(world);
  if (deformation_ && fit.deformation.cols() > 0) {
    deformation_->graph().apply(motions(fit), world);
  }
}

Eigen::VectorXd HandTracker::confidence(const HandFit& fit) const {
  const Triangles& triangles = hand_->mesh().triangles();
  Eigen::VectorXd result = Eigen::VectorXd::Zero(triangles.cols());
  if (fit.seen_vertex.size() == 0) {
    return result;
  }
  for (Eigen::Index f = 0; f < triangles.cols(); ++f) {
    result(f) = fit.seen_vertex(triangles.col(f)).mean();
  }
  return result;
}

}  // namespace touchfield
