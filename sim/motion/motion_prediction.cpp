#include "sim/motion/motion_prediction.h"

#include <utility>

namespace touchfield {

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
