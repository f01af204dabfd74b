#pragma once

#include <vector>

#include <Eigen/Core>

#include "sim/motion/motion_sensor.h"

namespace touchfield {

/// A Kalman filter of many values with measurement noise of 1 and the same process noise for all. The values share one
/// covariance and its gains. A sample therefore costs an axpy for each part of the state.
///
/// The state of a value is x, its velocity and, of order 3, its acceleration, by time in any unit. Over a time d it
/// moves at its highest derivative. That derivative jumps at the beginning of d by a number of variance noise d:
///
///     F = (1, d, d^2 / 2; 0, 1, d; 0, 0, 1),   Q = noise d g g^T,   g = (d^2 / 2, d, 1), or (d, 1) of order 2
///
/// In steady state with d = 1 and order 2 the gains of position (a) and velocity (b) obey
///
///     b = a^2 / (2 - a),   noise = b^2 / (1 - a)
///
/// (the filter of Benedict and Bordner, IRE Trans. Automatic Control 7, 1962). With much noise the filter is the
/// straight line through the last two samples. Without noise it is the mean of all samples.
///
/// It begins with the first sample at rest. The variance of derivative k begins as noise^((2 k + 1) / (2 order)). That
/// is its value in steady state except for a factor near 1.
class KalmanFilter {
 public:
  /// order   2 or 3
  KalmanFilter(int order, double noise) : order_(order), noise_(noise) {}

  int order() const { return order_; }
  Eigen::Index size() const { return states_.rows(); }
  void begin(const Eigen::Ref<const Eigen::VectorXd>& values);

  /// One sample, a time d > 0 after the one before; all of so many values as the first.
  ///
  /// innovation   gets what was measured - what was expected
  /// returns      the variance of an innovation that the filter expects
  double see(double d, const Eigen::Ref<const Eigen::VectorXd>& values, Eigen::VectorXd& innovation);

  /// Adds share x the values expected a time d after the last sample.
  void add(double d, double share, Eigen::VectorXd& sum) const;

  /// Of the last sample: what of an innovation goes into value and derivatives.
  const Eigen::VectorXd& gains() const { return gains_; }

 private:
  int order_;
  double noise_;
  Eigen::MatrixXd covariance_;  // order x order
  Eigen::VectorXd gains_;
  Eigen::MatrixXd states_;  // values x order
};

/// Values expected from noisy samples. The noise and the speed of the values need not be known.
///
/// Several filters see the same samples. Some assume constant velocity, with noise of 1e-6 to 100 times that of a
/// sample, or of less than 1e-6 where samples come more often than 30 times per second. The others assume constant
/// acceleration. The expected value is their mean, weighted by the likelihood of the samples under each. Innovations e
/// have the variance r S, with each filter's own best scale r, over the last 0.3 s:
///
///     ln weight = -2 sum(g) ln(sum(g e^2 / S) / sum(g)) - 2 sum(g ln S) - (5 at constant acceleration),
///     g = exp(-age / 0.3 s)
///
/// e^2 is the mean over the values. They count as four independent ones, because the errors of a skin are correlated. A
/// hand at rest is therefore averaged, and one that starts or turns is followed at once. At reversals, filters at
/// constant velocity alone are only as good as a straight line.
///
/// The expected value is a weighted sum of the samples, with the same weights for all values. A quantity that depends
/// linearly on the values may therefore be filtered before or after.
class KalmanBank {
 public:
  /// interval   between samples, about [s]: within a factor of 5
  explicit KalmanBank(double interval);

  void restart() { samples_ = 0; }

  /// A sample, later than those before it and of as many values.
  ///
  /// evaluated   how many values, from the first one, the weights are told by; >= 1
  void see(double seconds, const Eigen::Ref<const Eigen::VectorXd>& values, Eigen::Index evaluated);

  /// Values expected at a time; after the first sample that sample. There must be one.
  Eigen::VectorXd at(double seconds) const;

 private:
  struct Member {
    KalmanFilter filter;
    double energy = 0;        // sum(g e^2 / S)
    double log_variance = 0;  // sum(g ln S)
    double weight = 0;
  };
  void weigh();

  double interval_;
  std::vector<Member> members_;
  int samples_ = 0;
  double last_ = 0;    // time of the last sample [s]
  double memory_ = 0;  // sum(g)
  double floor_ = 0;   // of e^2: rounding
  Eigen::VectorXd innovation_;
};

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
