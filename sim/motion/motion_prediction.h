#pragma once

#include <vector>

#include "sim/motion/kalman_bank.h"
#include "sim/motion/motion_sensor.h"

namespace touchfield {

/// Where what a sensor saw is expected to be, as motion.predict says:
///
/// none     where it was seen last;
/// linear   on the straight line through the last two samples, so that an rms of noise e in them becomes e sqrt((1 +
///          s)^2 + s^2) at s times the time between them beyond the last;
/// kalman   by a KalmanBank for each number that changes, one for the vertices of meshes over time, and one for the
///          skin that is seen, which takes the skin beyond along.
///
/// Nothing is expected across a lost sample: it begins again with the sample after it.
class MotionPrediction {
 public:
  /// interval   between samples, about [s]
  explicit MotionPrediction(MotionSpec::Prediction kind = MotionSpec::Prediction::kNone, double interval = 1.0);

  /// The next sample; one that is not later than the last changes nothing.
  void see(const Seen& seen);

  /// Whether it knows where things move; if not, at() is what was seen last.
  bool predicts() const { return kind_ != MotionSpec::Prediction::kNone && samples_ >= 2; }

  /// The state expected at a time. Its numbers may be out of their ranges (MovingModel::in_range). There must be a
  /// sample, the last one not lost.
  MotionState at(double seconds) const;

 private:
  void see_values(const MotionState& state);

  MotionSpec::Prediction kind_;
  double interval_;
  int samples_ = 0;  // without a loss
  Seen last_{};
  Seen before_{};
  std::vector<KalmanBank> numbers_;
  KalmanBank vertices_;
  KalmanBank skin_;
};

}  // namespace touchfield
