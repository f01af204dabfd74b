#include "sim/motion/motion_prediction.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace touchfield {

namespace {

// Chosen for motions like those of scripts/tables prediction, seen by cameras.
constexpr double kMemory = 0.3;         // of the likelihoods [s]
constexpr double kIndependent = 4;      // values among those of a skin
constexpr double kAccelerates = -5;     // the logarithm of how likely that is beforehand, against a constant velocity
constexpr double kChosenAt = 1 / 30.0;  // the interval that the slowest filters were chosen at [s]
constexpr double kRounding = 1e-10;     // of a value, relative

Eigen::MatrixXd transition(int order, double d) {
  Eigen::Matrix3d all;
  all << 1, d, 0.5 * d * d, 0, 1, d, 0, 0, 1;
  return all.topLeftCorner(order, order);
}

}  // namespace

void KalmanFilter::begin(const Eigen::Ref<const Eigen::VectorXd>& values) {
  states_.setZero(values.size(), order_);
  states_.col(0) = values;
  covariance_.setZero(order_, order_);
  covariance_(0, 0) = 1;
  for (int k = 1; k < order_; ++k) {
    covariance_(k, k) = std::pow(noise_, (2.0 * k + 1.0) / (2.0 * order_));
  }
  gains_ = Eigen::VectorXd::Unit(order_, 0);
}

double KalmanFilter::see(double d, const Eigen::Ref<const Eigen::VectorXd>& values, Eigen::VectorXd& innovation) {
  const Eigen::MatrixXd forward = transition(order_, d);
  const Eigen::VectorXd jump = forward.col(order_ - 1);
  covariance_ = (forward * covariance_ * forward.transpose() + noise_ * d * jump * jump.transpose()).eval();
  for (int row = 0; row + 1 < order_; ++row) {  // in place: a row needs those below as they were
    for (int k = row + 1; k < order_; ++k) {
      states_.col(row) += forward(row, k) * states_.col(k);
    }
  }
  innovation = values - states_.col(0);
  const double variance = covariance_(0, 0) + 1.0;
  gains_ = covariance_.col(0) / variance;
  for (int k = 0; k < order_; ++k) {
    states_.col(k) += gains_(k) * innovation;
  }
  covariance_ -= (gains_ * covariance_.row(0)).eval();
  return variance;
}

void KalmanFilter::add(double d, double share, Eigen::VectorXd& sum) const {
  const Eigen::MatrixXd forward = transition(order_, d);
  for (int k = 0; k < order_; ++k) {
    sum += share * forward(0, k) * states_.col(k);
  }
}

KalmanBank::KalmanBank(double interval) : interval_(interval) {
  // A hand moves no quicker where it is seen more often: there it takes filters that are slower for each sample.
  const double slower = std::min(1.0, interval / kChosenAt);
  for (const double noise : {100.0, 1.0, 0.3}) {
    members_.push_back({KalmanFilter(2, noise)});
  }
  for (double noise = 0.1; noise > 0.5e-6 * std::pow(slower, 3); noise *= 0.1) {
    members_.push_back({KalmanFilter(2, noise)});
  }
  for (const double noise : {1.0, 0.3}) {
    members_.push_back({KalmanFilter(3, noise)});
  }
  for (double noise = 0.01; noise > 0.5 * std::pow(slower, 5); noise *= 0.01) {
    members_.push_back({KalmanFilter(3, noise)});
  }
}

void KalmanBank::see(double seconds, const Eigen::Ref<const Eigen::VectorXd>& values, Eigen::Index evaluated) {
  const double since = seconds - last_;
  last_ = seconds;
  ++samples_;
  if (samples_ == 1) {
    memory_ = 0;
    for (Member& member : members_) {
      member.filter.begin(values);
      member.energy = member.log_variance = 0;
      member.weight = 1.0 / static_cast<double>(members_.size());
    }
    return;
  }
  const double kept = std::exp(-since / kMemory);
  memory_ = kept * memory_ + 1.0;
  for (Member& member : members_) {
    const double variance = member.filter.see(since / interval_, values, innovation_);
    member.energy =
        kept * member.energy + innovation_.head(evaluated).squaredNorm() / variance / static_cast<double>(evaluated);
    member.log_variance = kept * member.log_variance + std::log(variance);
  }
  floor_ = std::pow(kRounding, 2) * values.head(evaluated).squaredNorm() / static_cast<double>(evaluated) +
           std::numeric_limits<double>::min();
  weigh();
}

void KalmanBank::weigh() {
  double most = -std::numeric_limits<double>::infinity();
  for (Member& member : members_) {
    const double scale = member.energy / memory_ + floor_;
    member.weight = -0.5 * kIndependent * (memory_ * std::log(scale) + member.log_variance) +
                    (member.filter.order() == 3 ? kAccelerates : 0.0);
    most = std::max(most, member.weight);
  }
  double sum = 0;
  for (Member& member : members_) {
    member.weight = std::exp(member.weight - most);
    sum += member.weight;
  }
  for (Member& member : members_) {
    member.weight /= sum;
  }
}

Eigen::VectorXd KalmanBank::at(double seconds) const {
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(members_.front().filter.size());
  for (const Member& member : members_) {
    member.filter.add((seconds - last_) / interval_, member.weight, sum);
  }
  return sum;
}

namespace {

Eigen::Map<const Eigen::VectorXd> values_of(const Points& points) { return {points.data(), points.size()}; }

Points points_of(const Eigen::Ref<const Eigen::VectorXd>& values) {
  return Eigen::Map<const Points>(values.data(), 3, values.size() / 3);
}

}  // namespace

MotionPrediction::MotionPrediction(MotionSpec::Prediction kind, double interval)
    : kind_(kind), interval_(interval), vertices_(interval), skin_(interval) {}

void MotionPrediction::see(const Seen& seen) {
  if (seen.lost) {
    samples_ = 0;
    return;
  }
  if (samples_ > 0 && seen.seconds <= last_.seconds) {
    return;
  }
  before_ = std::exchange(last_, seen);
  ++samples_;
  if (kind_ == MotionSpec::Prediction::kKalman) {
    see_values(seen.state);
  }
}

void MotionPrediction::see_values(const MotionState& state) {
  const double seconds = last_.seconds;
  if (samples_ == 1) {
    numbers_.assign(static_cast<std::size_t>(state.numbers.size()), KalmanBank(interval_));
    vertices_.restart();
    skin_.restart();
  }
  for (std::size_t i = 0; i < numbers_.size(); ++i) {
    numbers_[i].see(seconds, state.numbers.segment<1>(static_cast<Eigen::Index>(i)), 1);
  }
  if (state.vertices) {
    vertices_.see(seconds, values_of(*state.vertices), state.vertices->size());
  }
  if (state.skin) {
    const Eigen::Index own = state.skin->size();
    Eigen::VectorXd values(own + (state.patches ? state.patches->size() : 0));
    values.head(own) = values_of(*state.skin);
    if (state.patches) {
      values.tail(state.patches->size()) = values_of(*state.patches);
    }
    skin_.see(seconds, values, own);
  }
}

MotionState MotionPrediction::at(double seconds) const {
  if (!predicts()) {
    return last_.state;
  }
  if (kind_ == MotionSpec::Prediction::kLinear) {
    return last_.state.beyond(before_.state, (seconds - last_.seconds) / (last_.seconds - before_.seconds));
  }
  MotionState state = last_.state;
  for (std::size_t i = 0; i < numbers_.size(); ++i) {
    state.numbers.segment<1>(static_cast<Eigen::Index>(i)) = numbers_[i].at(seconds);
  }
  if (state.vertices) {
    *state.vertices = points_of(vertices_.at(seconds));
  }
  if (state.skin) {
    const Eigen::VectorXd values = skin_.at(seconds);
    const Eigen::Index own = state.skin->size();
    *state.skin = points_of(values.head(own));
    if (state.patches) {
      *state.patches = points_of(values.tail(state.patches->size()));
    }
  }
  return state;
}

}  // namespace touchfield
