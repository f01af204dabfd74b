#include "sim/cameras/pose_fit.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Dense>

#include "sim/core/units.h"
#include "sim/mesh/face_shape.h"
#include "solvers/phase/levenberg_marquardt.h"

namespace touchfield {

namespace {

constexpr double kCorrelated = 8;           // points that count as one
constexpr double kLeastCosine = 0.3;        // between a point's normal and the skin's
constexpr double kSlack = 10 * kDegree;     // of the joints' ranges
constexpr double kMostTurn = 20 * kDegree;  // in a step
constexpr double kMostShift = 40e-3;        // [m]
constexpr double kEnd = 12e-3;              // of the skin, where it is rounded off and an arm goes on [m]

/// Weights of the corners at the point of a triangle that is nearest to x.
Vector3 nearest_weights(const Vector3& a, const Vector3& b, const Vector3& c, const Vector3& x) {
  const Vector3 foot = nearest_on_triangle(a, b, c, x);
  const Vector3 area = (b - a).cross(c - a);
  const double whole = area.squaredNorm();
  const double at_a = (b - foot).cross(c - foot).dot(area) / whole;
  const double at_b = (c - foot).cross(a - foot).dot(area) / whole;
  return {at_a, at_b, 1 - at_a - at_b};
}

/// The step shortened so that neither a joint nor the place leaps.
PoseVector shortened(const PoseVector& step) {
  const double turn =
      std::max(step.head<3>().norm(), step.tail<JointAngles::SizeAtCompileTime>().cwiseAbs().maxCoeff());
  const double most = std::max({1.0, turn / kMostTurn, step.segment<3>(3).norm() / kMostShift});
  return step / most;
}

}  // namespace

HandState moved(const HandState& state, const PoseVector& by, const Vector3& centre) {
  const double angle = by.head<3>().norm();
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
  if (angle > 0) {
    turn = Eigen::AngleAxisd(angle, by.head<3>() / angle).toRotationMatrix();
  }
  HandState result;
  result.place.rotation = Eigen::Quaterniond(turn * state.place.rotation).normalized().toRotationMatrix();
  result.place.shift = turn * (state.place.shift - centre) + centre + by.segment<3>(3);
  result.joints = state.joints + by.tail<JointAngles::SizeAtCompileTime>();
  return result;
}

PoseFit::PoseFit(const HandTemplate& hand) : hand_(hand) {
  const JointRanges ranges = joint_ranges();
  least_ = ranges.least.array() - kSlack;
  most_ = ranges.most.array() + kSlack;
  end_ = hand.mesh().vertices().row(1).minCoeff() + kEnd;
}

void PoseFit::place_skin(const ShapedHand& shape, const HandState& state) {
  hand_.carry(shape, hand_.skeleton_at(shape.proportions, state.joints), vertices_);
  for (auto&& vertex : vertices_.colwise()) {
    vertex = state.place.rotation * vertex + state.place.shift;
  }
  vertex_normals(vertices_, hand_.mesh().triangles(), normals_);
}

bool PoseFit::match_point(const HandPoints& points, int i, int vertex, SkinMatch& match) const {
  const Vector3 p = points.at.col(i);
  double least = std::numeric_limits<double>::infinity();
  for (const Eigen::Index f : hand_.faces_round().of(vertex)) {
    const auto face = hand_.mesh().triangles().col(f);
    const Vector3 weights = nearest_weights(vertices_.col(face(0)), vertices_.col(face(1)), vertices_.col(face(2)), p);
    const double squared = (vertices_(Eigen::all, face) * weights - p).squaredNorm();
    if (squared < least) {
      least = squared;
      match.face = static_cast<int>(f);
      match.weights = weights;
    }
  }
  const auto face = hand_.mesh().triangles().col(match.face);
  Vector3 normal = Vector3::Zero();
  Vector3 foot = Vector3::Zero();
  double planes = 0;
  for (int c = 0; c < 3; ++c) {
    const double weight = match.weights(c);
    normal += weight * normals_.col(face(c));
    foot += weight * vertices_.col(face(c));
    planes += weight * normals_.col(face(c)).dot(p - vertices_.col(face(c)));
  }
  normal.normalize();
  if (normal.dot(points.normal.col(i)) < kLeastCosine) {
    return false;
  }
  Eigen::Index heaviest = 0;
  match.weights.maxCoeff(&heaviest);
  match.point = i;
  match.vertex = face(heaviest);
  if (hand_.mesh().vertices()(1, match.vertex) < end_) {
    return false;
  }
  match.normal = normal;
  match.residual = 0.5 * (normal.dot(p - foot) + planes);
  return true;
}

double PoseFit::match(const ShapedHand& shape, const HandPoints& points, const HandState& state, double reach,
                      double scale, int stride) {
  place_skin(shape, state);
  return match_placed(points, reach, scale, stride);
}

double PoseFit::match_placed(const HandPoints& points, double reach, double scale, int stride) {
  grid_.build(vertices_, normals_, reach);
  matches_.clear();
  const double most = scale * scale;
  double cost = 0;
  for (int i = 0; i < points.size(); i += stride) {
    const double squared_deviation =
        kCorrelated * (points.sigma(i) * points.sigma(i) + model_error_ * model_error_) / stride;
    const int vertex = grid_.nearest(points.at.col(i), points.normal.col(i));
    SkinMatch match;
    if (vertex < 0 || !match_point(points, i, vertex, match)) {
      cost += most / squared_deviation;
      continue;
    }
    const double square = match.residual * match.residual;
    const double damping = 1 / (1 + square / most);
    match.weight = damping * damping / squared_deviation;
    cost += square * damping / squared_deviation;
    matches_.push_back(match);
  }
  return cost;
}

void PoseFit::twist_bones(const ShapedHand& shape, const HandState& state) {
  constexpr double kStep = 1e-6;  // [rad]
  const auto motions_at = [&](const JointAngles& joints) {
    return SkinnedHand::bone_motions(shape.skeleton, hand_.skeleton_at(shape.proportions, joints));
  };
  const auto before = motions_at(state.joints);
  const auto twist = [&](std::size_t bone, Eigen::Index j, const RigidMotion& after) {
    const Eigen::Matrix3d turn = after.rotation * before[bone].rotation.transpose();
    const Vector3 omega = 0.5 * Vector3(turn(2, 1) - turn(1, 2), turn(0, 2) - turn(2, 0), turn(1, 0) - turn(0, 1));
    const Vector3 shift = after.shift - turn * before[bone].shift;
    twists_[bone].col(j) << omega / kStep, shift / kStep;
  };
  for (std::size_t d = 0; d < HandSkeleton::kDigits; ++d) {
    for (Eigen::Index j = 0; j < joint_count(d); ++j) {
      JointAngles turned = state.joints;
      turned(first_joint(d) + j) += kStep;
      const auto after = motions_at(turned);
      for (std::size_t bone = 0; bone < 3; ++bone) {
        const std::size_t b = SkinnedHand::bone_number(d, bone);
        twist(b, j, after[b]);
      }
      if (d == 0) {
        twist(SkinnedHand::kSwing, j, after[SkinnedHand::kSwing]);
      }
    }
  }
}

void PoseFit::differentiate(const ShapedHand& shape, const HandState& state, const Vector3& centre) {
  twist_bones(shape, state);
  const auto count = static_cast<Eigen::Index>(matches_.size());
  if (rows_.cols() < count) {
    rows_.resize(Eigen::NoChange, count);
    weighted_.resize(Eigen::NoChange, count);
  }
  const Eigen::Matrix3d& rotation = state.place.rotation;
  for (Eigen::Index m = 0; m < count; ++m) {
    const SkinMatch& match = matches_[static_cast<std::size_t>(m)];
    const auto face = hand_.mesh().triangles().col(match.face);
    const Vector3 foot = vertices_(Eigen::all, face) * match.weights;
    auto row = rows_.col(m);
    row.setZero();
    row.head<3>() = (foot - centre).cross(match.normal);
    row.segment<3>(3) = match.normal;
    Vector3 normal = rotation.transpose() * match.normal;
    Vector3 x = rotation.transpose() * (foot - state.place.shift);
    normal.x() *= hand_.side();
    x.x() *= hand_.side();
    Eigen::Matrix<double, 6, 1> wrench;
    wrench << x.cross(normal), normal;
    for (const SkinnedHand::Influence& one : hand_.influences(match.vertex)) {
      if (one.bone == SkinnedHand::kPalm) {
        continue;
      }
      const std::size_t digit = one.bone == SkinnedHand::kSwing ? 0 : (one.bone - 1) / 3;
      for (Eigen::Index j = 0; j < joint_count(digit); ++j) {
        row(kPlaceUnknowns + first_joint(digit) + j) += one.weight * twists_[one.bone].col(j).dot(wrench);
      }
    }
    row.tail<JointAngles::SizeAtCompileTime>().array() *= hand_.free_joints().array();
  }
}

/// The normal equations of the matches, and what they say of the fit.
PoseFit::Equations PoseFit::equations(const HandPoints& points, int stride) {
  Equations result;
  double squares = 0;
  double weights = 0;
  int explained = 0;
  for (std::size_t m = 0; m < matches_.size(); ++m) {
    const SkinMatch& match = matches_[m];
    const auto column = static_cast<Eigen::Index>(m);
    weighted_.col(column) = std::sqrt(match.weight) * rows_.col(column);
    result.slope += match.weight * match.residual * rows_.col(column);
    squares += match.weight * match.residual * match.residual;
    weights += match.weight;
    explained += std::abs(match.residual) < 1e-3 + 3 * points.sigma(match.point) ? 1 : 0;
  }
  result.curvature.selfadjointView<Eigen::Lower>().rankUpdate(
      weighted_.leftCols(static_cast<Eigen::Index>(matches_.size())));
  result.curvature = result.curvature.selfadjointView<Eigen::Lower>();
  result.residual = weights > 0 ? std::sqrt(squares / weights) : 0;
  result.explained = static_cast<double>(explained) * stride / static_cast<double>(points.size());
  return result;
}

/// The rounds of a fit, with the equations of the state that was accepted last. What matches changes with every round.
class PoseFit::Descent {
 public:
  Descent(PoseFit& fit, const ShapedHand& shape, const HandPoints& points, const HandState& start,
          const PosePrior& prior, const PoseFitOptions& options)
      : fit_(fit),
        shape_(shape),
        points_(points),
        prior_(prior),
        options_(options),
        centre_(points.at.rowwise().mean()),
        stiffness_(prior.deviation.array().square().inverse()),
        reach_(options.first_reach),
        tried_(start) {
    evaluate();
    accept();
  }

  /// Points are looked for nearer to the skin from here on: other costs do not compare.
  void narrow() {
    const double next = std::max(options_.reach, 0.5 * reach_);
    if (next < reach_) {
      least_ = std::numeric_limits<double>::infinity();
    }
    reach_ = next;
  }

  /// To the state that a step leads to.
  const HandState& move(double mu) {
    constexpr double kTurnHeld = 1e-2;  // [1/rad2], where no point says anything
    constexpr double kShiftHeld = 1e2;  // [1/m2]
    PoseMatrix curvature = equations_.curvature;
    curvature.diagonal() *= 1 + mu;
    curvature.diagonal().head<3>().array() += kTurnHeld;
    curvature.diagonal().segment<3>(3).array() += kShiftHeld;
    PoseVector step = PoseVector::Zero();
    if (options_.place_only) {
      step.head<kPlaceUnknowns>() = curvature.topLeftCorner<kPlaceUnknowns, kPlaceUnknowns>().ldlt().solve(
          equations_.slope.head<kPlaceUnknowns>());
    } else {
      step = curvature.ldlt().solve(equations_.slope);
      step.tail<JointAngles::SizeAtCompileTime>().array() *= fit_.hand_.free_joints().array();
    }
    step = shortened(step);
    predicted_ = step.dot(2 * equations_.slope - equations_.curvature * step);
    tried_ = moved(result_.state, step, centre_);
    tried_.joints = tried_.joints.cwiseMax(fit_.least_).cwiseMin(fit_.most_);
    return tried_;
  }

  bool solve(double mu) {
    move(mu);
    evaluate();
    return true;
  }

  bool lowers_cost() const { return cost_ <= least_; }

  double accept() {
    const double gain = (least_ - cost_) / predicted_;
    least_ = cost_;
    fit_.differentiate(shape_, tried_, centre_);
    equations_ = fit_.equations(points_, options_.stride);
    equations_.slope.tail<JointAngles::SizeAtCompileTime>() += stiffness_.cwiseProduct(prior_.joints - tried_.joints);
    equations_.curvature.diagonal().tail<JointAngles::SizeAtCompileTime>() += stiffness_;
    result_ = {tried_, equations_.residual, equations_.explained};
    return gain;
  }

  static bool rests() { return false; }
  static Refusal refuse() { return Refusal::kDamp; }

  /// Of the state accepted last.
  const PoseFitResult& result() const { return result_; }

 private:
  void evaluate() {
    cost_ = fit_.match(shape_, points_, tried_, reach_, std::max(options_.scale, reach_ / 3), options_.stride);
    cost_ += stiffness_.dot((tried_.joints - prior_.joints).cwiseAbs2());
  }

  PoseFit& fit_;
  const ShapedHand& shape_;
  const HandPoints& points_;
  const PosePrior& prior_;
  const PoseFitOptions& options_;
  Vector3 centre_;
  JointAngles stiffness_;
  double reach_;
  HandState tried_;
  double cost_ = 0;
  double least_ = std::numeric_limits<double>::infinity();
  double predicted_ = 1;
  Equations equations_;
  PoseFitResult result_{};
};

PoseFitResult PoseFit::fit(const ShapedHand& shape, const HandPoints& points, const HandState& start,
                           const PosePrior& prior, const PoseFitOptions& options) {
  constexpr double kFirstDamping = 1e-4;         // of the curvature
  constexpr double kDampingAfterFailure = 1e-2;  // at least
  if (points.size() == 0) {
    return {start, 0, 0};
  }
  Descent descent(*this, shape, points, start, prior, options);
  MadsenDamping damping(kFirstDamping, kDampingAfterFailure);
  for (int round = 1; round < options.rounds; ++round) {
    descent.narrow();
    try_step(descent, damping);
  }
  PoseFitResult result = descent.result();
  result.state = descent.move(damping.value());
  return result;
}

}  // namespace touchfield
