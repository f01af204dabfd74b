#include "sim/cameras/hand_tracker.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <utility>

#include <Eigen/Geometry>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include "sim/core/version.h"

namespace touchfield {

namespace {

constexpr double kFollowReach = 8e-3;        // from the predicted skin [m]
constexpr double kSharp = 2e-3;              // of robust weights about a skin that is known [m]
constexpr double kPolishError = 0.7e-3;      // model error that a right fit may go down to [m]
constexpr double kStiffTurn = 2 * kDegree;   // of joints that hardly move
constexpr double kFollowTurn = 6 * kDegree;  // deviation of joints from what is predicted
constexpr double kRegionMargin = 40e-3;      // round the hand where points are looked for [m]
constexpr double kNear = 12e-3;              // points count as near the skin [m]
constexpr double kBeside = 20e-3;            // of points that no skin is matched with [m]
constexpr double kBesideBeyond = 8e-3;       // of those beyond the workspace, which may cut a table off [m]
constexpr double kBehindWrist = -5e-3;       // y in the hand's frame [m]
constexpr double kMostNoise = 1e-3;          // points with more show no hand better [m]
constexpr double kNoisy = 0.8e-3;            // [m]
constexpr double kWithin = 2.5e-3;           // points on the skin are, besides model error and noise [m]
constexpr double kSightTolerance = 7e-3;     // [m]
constexpr Eigen::Index kLeastFitPoints = 150;
constexpr std::size_t kStartsPerFrame = 2;
constexpr std::size_t kPosturesPerFrame = 2;
constexpr std::size_t kStartsOfAFrame = 6;
constexpr std::size_t kStartsOfAnImage = 24;  // of images so far apart that each is searched for itself
constexpr Eigen::Index kPointsOfStart = 500;
constexpr std::size_t kBestFits = 4;                               // fits of which digits are moved
constexpr double kSeldom = 0.1;                                    // frames so far apart show no motion [s]
constexpr std::array<double, 4> kSizes = {0.84, 0.92, 1.0, 1.08};  // of the template's, that are looked for

/// The template's posture and, where its joints are free, others: fingers far apart, half bent, and all but the index
/// finger curled, the thumb beside them or over them.
std::vector<JointAngles> postures(const HandTemplate& hand) {
  const JointAngles own = joint_angles(hand.pose());
  std::vector<JointAngles> all{own};
  if (hand.free_joints().minCoeff() == 1) {
    JointAngles apart = own;
    JointAngles bent = own;
    constexpr std::array<double, 4> kAbduction = {16, 2, 12, 26};
    for (Eigen::Index finger = 0; finger < 4; ++finger) {
      const Eigen::Index first = first_joint(static_cast<std::size_t>(finger) + 1);
      apart(first) = kAbduction[static_cast<std::size_t>(finger)] * kDegree;
      bent.segment<3>(first + 1) += Vector3(25, 30, 15) * kDegree;
    }
    JointAngles over = joint_angles(hand_pose("index_up"));
    JointAngles beside = over;
    beside.head<5>() = own.head<5>();
    beside.segment<2>(3) = Eigen::Vector2d(20, 30) * kDegree;
    for (std::size_t finger = 2; finger < HandSkeleton::kDigits; ++finger) {  // tighter than under a thumb
      beside.segment<3>(first_joint(finger) + 1) = Vector3(92, 105, 60) * kDegree;
    }
    all.insert(all.end(), {apart, bent, beside, over});
  }
  return all;
}

/// How far joints are from those of a posture [rad], from thumb to little finger.
JointAngles posture_deviation() {
  JointAngles deviation;
  deviation.head<5>() << 12, 12, 12, 20, 20;
  for (std::size_t finger = 1; finger < HandSkeleton::kDigits; ++finger) {
    deviation.segment<4>(first_joint(finger)) << 7, 18, 20, 14;
  }
  return kDegree * deviation;
}

int confirming_cameras(const HandFit& fit) {
  return static_cast<int>(std::ranges::count_if(fit.confirmed, [](int vertices) { return vertices > 0; }));
}

/// The probability that a fit is right, by a logistic regression on fits to images with and without hands
/// (scripts/hand_belief).
double probability_of(const HandFit& fit) {
  const auto lack = [](double share) { return std::log(1.01 - share); };
  const double logit = 5.04 - 0.86 * lack(fit.explained) - 0.15 * lack(fit.share) - 1.07 * lack(fit.evidence) -
                       3.50 * fit.misfit - 0.20 * fit.digits_off - 0.32 * fit.oddity +
                       4.06 * std::log(fit.seen + 0.02) + (confirming_cameras(fit) > 1 ? 2.28 : 0.0);
  return 1 / (1 + std::exp(-logit));
}

class Stopwatch {
 public:
  explicit Stopwatch(double& seconds) : seconds_(seconds) {}
  ~Stopwatch() { seconds_ += steady_now() - start_; }
  Stopwatch(const Stopwatch&) = delete;
  Stopwatch& operator=(const Stopwatch&) = delete;

 private:
  double& seconds_;
  double start_ = steady_now();
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
    return fmt::format("points in the search box {} ({} required)", points, kLeastFitPoints);
  }
  if (!fit.placed) {
    return "nothing as large as a hand";
  }
  std::string text = fmt::format(
      "probability {:.2f} ({:g} required): {:.0f} % of the points near the skin lie on it; {:.0f} % of the skin that "
      "should be seen is seen",
      fit.probability, fit.required, 100 * fit.explained, 100 * fit.evidence);
  if (fit.digits_off > 0) {
    text +=
        fmt::format("; {} of the fingertips are not where they are fitted, fingers apart show more", fit.digits_off);
  }
  if (confirming_cameras(fit) < 2) {
    text += fit.noise > kNoisy ? "; a nearer camera shows more" : "; another camera shows more";
  }
  return text;
}

double HandFit::explained_area() const { return seen_area * evidence * explained * explained; }

double HandFit::worth() const { return explained_area() * probability; }

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
      postures_(postures(*hand_)) {
  fit_.expect_model_error(kUnknownSkinError);
  look_for(shape_, {kSizes.begin(), kSizes.end()});
  for (Eigen::Index v = 0; v < hand_->mesh().vertex_count(); ++v) {
    const std::size_t bone = hand_->influences(v).front().bone;
    const bool end = bone != SkinnedHand::kPalm && bone != SkinnedHand::kSwing && (bone - 1) % 3 == 2;
    digit_.push_back(end ? static_cast<int>((bone - 1) / 3) : -1);
  }
  if (options.node_spacing > 0) {
    deformation_.emplace(DeformationGraph(hand_->mesh(), options.node_spacing));
  }
}

void HandTracker::look_for(const ShapedHand& shape, std::vector<double> sizes) {
  std::vector<TriangleMesh> skins;
  for (const JointAngles& joints : postures_) {
    Points vertices;
    hand_->carry(shape, hand_->skeleton_at(shape.proportions, joints), vertices);
    skins.emplace_back(vertices, hand_->mesh().triangles());
  }
  search_.emplace(skins, std::move(sizes));
}

void HandTracker::forget() {
  past_.clear();
  starts_.clear();
  shifts_.resize(3, 0);
  last_ = -std::numeric_limits<double>::infinity();
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

HandPoints HandTracker::read(const DepthFrame& frame, const Box& within) {
  const Stopwatch watch(times_.points);
  return reader_.read(frame, within);
}

Box HandTracker::region(const HandState& state) const {
  Points vertices;
  hand_->carry(shape_, hand_->skeleton_at(shape_.proportions, state.joints), vertices);
  return box_round(state.place(vertices), kRegionMargin).intersection(workspace_);
}

/// Digits whose last bones the images do not show where they are fitted.
std::vector<std::size_t> HandTracker::digits_missing() const {
  constexpr double kLeastSaid = 6;
  constexpr double kLeast = 0.45;  // 15 mm of air leave a third of a last bone
  std::array<double, HandSkeleton::kDigits> confirmed{};
  std::array<double, HandSkeleton::kDigits> said{};
  for (std::size_t v = 0; v < digit_.size(); ++v) {
    if (digit_[v] >= 0) {
      const auto d = static_cast<std::size_t>(digit_[v]);
      const auto vertex = static_cast<Eigen::Index>(v);
      confirmed[d] += check_.seen(vertex) ? 1 : 0;
      said[d] += check_.said(vertex) ? 1 : 0;
    }
  }
  std::vector<std::size_t> missing;
  for (std::size_t d = 0; d < said.size(); ++d) {
    if (said[d] >= kLeastSaid && confirmed[d] < kLeast * said[d]) {
      missing.push_back(d);
    }
  }
  return missing;
}

/// Whether a fit is to be believed. Leaves the skin's matches in fit_ and what the images say of it in check_.
void HandTracker::evaluate(const DepthFrame& frame, const HandPoints& points, HandFit& fit) {
  const Stopwatch watch(times_.check);
  fit_.place_skin(shape_, fit.state);
  // A wall that the workspace cuts may look like a hand: what goes on beyond it tells.
  const Box round = box_round(fit_.vertices(), kBeside);
  const bool cut = !(workspace_.contains(round));
  const HandPoints beyond = cut ? reader_.read(frame, round) : HandPoints();
  const HandPoints& evaluated = cut ? beyond : points;
  fit_.match_placed(evaluated, kNear, kSharp);
  const Eigen::Matrix3d back = fit.state.place.rotation.transpose();
  const auto counts = [&](int point) {
    return (back * (evaluated.at.col(point) - fit.state.place.shift)).y() > kBehindWrist;
  };
  std::vector<bool> matched(static_cast<std::size_t>(evaluated.size()));
  Eigen::VectorXd near = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(cameras().size()));  // of each camera's points
  Eigen::VectorXd explained = near;
  double squares = 0;
  double noise = 0;
  double weights = 0;
  double rough_squares = 0;
  double rough_noise = 0;
  for (const SkinMatch& match : fit_.matches()) {
    matched[static_cast<std::size_t>(match.point)] = true;
    const double sigma = std::min(evaluated.sigma(match.point), kMostNoise);
    if (counts(match.point)) {
      const int camera = evaluated.camera[static_cast<std::size_t>(match.point)];
      near(camera) += 1;
      explained(camera) += std::abs(match.residual) < kWithin + fit_.model_error() + 2 * sigma ? 1 : 0;
    }
    squares += match.weight * match.residual * match.residual;
    noise += match.weight * sigma * sigma;
    weights += match.weight;
    rough_squares += match.residual * match.residual;
    rough_noise += sigma * sigma;
  }
  // What goes on beside the hand is no hand, or another one.
  skin_grid_.build(fit_.vertices(), fit_.normals(), kBeside);
  for (int point = 0; point < evaluated.size(); ++point) {
    if (!matched[static_cast<std::size_t>(point)] && counts(point)) {
      const double squared = skin_grid_.squared_distance(evaluated.at.col(point));
      const double beside = workspace_.contains(Vector3(evaluated.at.col(point))) ? kBeside : kBesideBeyond;
      near(evaluated.camera[static_cast<std::size_t>(point)]) += squared < beside * beside ? 1 : 0;
    }
  }
  fit.misfit = std::sqrt(std::max(0.0, rough_squares - rough_noise) /
                         std::max(1.0, static_cast<double>(fit_.matches().size()))) /
               (learnt_ ? 2 * fit_.model_error() : kUnknownSkinError);
  fit.oddity = learnt_ ? 0 : shape_.proportions.norm() / options_.learning.size;
  if (cut) {
    fit_.match_placed(points, kNear, kSharp);
  }
  check_sight(cameras(), frame, fit_.vertices(), fit_.normals(), kSightTolerance, options_.points.baseline, check_);
  fit.placed = true;
  fit.noise = weights > 0 ? std::sqrt(noise / weights) : 0;
  fit.near = static_cast<Eigen::Index>(near.sum());
  fit.confirmed = check_.confirmed_by;
  fit.digits_off = static_cast<int>(digits_missing().size());
  const TriangleMesh& mesh = hand_->mesh();
  fit.seen_vertex = check_.confirmed.cwiseMin(1.0);
  fit.seen = confidence(fit).dot(mesh.areas()) / mesh.total_area();
  fit.explained = explained.sum() / std::max(near.sum(), 1.0);
  const Eigen::VectorXd shares = explained.cwiseQuotient(near);  // 0 / 0 is NaN
  fit.explained_by.assign(shares.begin(), shares.end());
  fit.seen_area = fit.seen * mesh.total_area() * std::exp(shape_.proportions.head<2>().sum());
  fit.share = check_.share();
  fit.evidence = check_.evidence();
  fit.residual = weights > 0 ? std::sqrt(squares / weights) : 0;
  fit.required = options_.belief;
  fit.probability = fit.near >= kLeastFitPoints ? probability_of(fit) : 0;
  fit.lost = !(fit.probability >= options_.belief);
}

HandFit HandTracker::fitted(const DepthFrame& frame, const HandPoints& points, const HandState& start,
                            const PosePrior& prior) {
  HandFit fit;
  fit.seconds = frame.seconds;
  fit.state = start;
  if (points.size() < kLeastFitPoints) {
    return fit;
  }
  {
    const Stopwatch watch(times_.pose);
    const double reach = learning_ ? 2 * kFollowReach : kFollowReach;
    fit.state =
        fit_.fit(shape_, points, start, prior, {options_.rounds, reach, kFollowReach, fit_.robust_scale(), 1, false})
            .state;
  }
  evaluate(frame, points, fit);
  return fit;
}

/// Brings a hand that is some centimetres and tens of degrees off to where fitted() can take it up.
HandState HandTracker::brought_closer(const HandPoints& points, const HandState& start, const PosePrior& prior) {
  const Stopwatch watch(times_.pose);
  const int stride = std::max(1, static_cast<int>(points.size() / kPointsOfStart));
  const PosePrior stiff{start.joints, JointAngles::Constant(kStiffTurn)};
  const HandState placed = fit_.fit(shape_, points, start, stiff, {8, 30e-3, 15e-3, 8e-3, stride, true}).state;
  const HandState stiffly = fit_.fit(shape_, points, placed, stiff, {4, 20e-3, 12e-3, 6e-3, stride, false}).state;
  return fit_.fit(shape_, points, stiffly, prior, {6, 16e-3, 8e-3, 4e-3, stride, false}).state;
}

/// Follows starts of a search to where they lead, the best first: at length all of the postures, else some starts of
/// two postures per frame.
std::vector<HandTracker::Attempt> HandTracker::attempts(const DepthFrame& frame, const HandPoints& points,
                                                        bool thorough) {
  std::size_t most = kStartsPerFrame;
  if (starts_.empty() || thorough) {
    const Stopwatch watch(times_.search);
    std::vector<std::size_t> postures;
    for (std::size_t k = 0; k < (thorough ? postures_.size() : std::min(kPosturesPerFrame, postures_.size())); ++k) {
      postures.push_back(next_posture_++ % postures_.size());
    }
    starts_ = search_->starts(points, cameras(), frame, thorough ? kStartsOfAnImage : kStartsOfAFrame, postures);
    std::ranges::reverse(starts_);
    most = thorough ? starts_.size() : 1;
  }
  std::vector<Attempt> all;
  for (std::size_t k = 0; k < most && !starts_.empty() && (all.empty() || all.front().fit.lost || thorough); ++k) {
    const HandStart start = starts_.back();
    starts_.pop_back();
    if (!learnt_) {
      HandProportions by = HandProportions::Zero();
      by.head<2>().setConstant(std::log(start.size));
      shape_ = hand_->shaped(by);
    }
    const PosePrior prior{postures_[start.skin], posture_deviation()};
    const HandState near = brought_closer(points, {start.place, prior.joints}, prior);
    HandPoints own = read(frame, region(near));
    HandFit fit = fitted(frame, own, near, prior);
    all.push_back({std::move(fit), std::move(own), shape_, prior});
    std::ranges::stable_sort(all, std::greater{}, [](const Attempt& one) { return one.fit.worth(); });
    all.resize(std::min(all.size(), kBestFits));
  }
  return all;
}

HandFit HandTracker::found(const DepthFrame& frame, HandPoints& points) {
  HandFit none;
  none.seconds = frame.seconds;
  if (points.size() < kLeastFitPoints) {
    starts_.clear();
    return none;
  }
  const bool thorough = learning_ ? thorough_left_-- > 0 : apart_;
  std::vector<Attempt> all = attempts(frame, points, thorough);
  if (all.empty()) {
    return none;
  }
  if (thorough) {
    starts_.clear();
    for (Attempt& one : all) {
      if (one.fit.placed) {
        with_proportions(frame, one, kUnknownSkinError);
        if (one.fit.digits_off > 0) {
          with_digits_moved(frame, one);
          with_proportions(frame, one, kUnknownSkinError);
        }
      }
    }
    std::ranges::stable_sort(all, std::greater{}, [](const Attempt& one) { return one.fit.worth(); });
    if (!learnt_ && !all.front().fit.lost) {
      with_proportions(frame, all.front(), kPolishError);
    }
  }
  Attempt& best = all.front();
  shape_ = best.shape;
  points = std::move(best.points);
  if (best.fit.placed) {  // deformation goes on from its matches
    evaluate(frame, points, best.fit);
  }
  return std::move(best.fit);
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
    const double damping = 1 / (1 + match.residual * match.residual / (kSharp * kSharp));
    targets_.weight(m) = damping * damping;
  }
  NodeMotions motions = deformation_->graph().motions(fit_.vertices(), shifts_);
  deformation_->fit(targets_, options_.deformation, shifts_, 1, motions);
  fit.deformation = DeformationGraph::shifts(motions);
  shifts_ = fit.deformation;
}

HandFit HandTracker::track_points(const DepthFrame& frame, HandPoints& points) {
  times_ = {};
  apart_ = frame.seconds > last_ + kSeldom;
  last_ = frame.seconds;
  HandFit fit;
  if (!past_.empty()) {
    const HandState from = predicted(frame.seconds);
    points = read(frame, region(from));
    fit = fitted(frame, points, from, {from.joints, JointAngles::Constant(kFollowTurn)});
  }
  if (past_.empty() || (fit.lost && apart_)) {
    past_.clear();
    points = read(frame, workspace_);
    fit = found(frame, points);
  }
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
