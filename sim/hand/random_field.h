#pragma once

#include <cstdint>

#include "sim/core/types.h"

namespace touchfield {

/// A smooth random field in space, of zero mean and with the covariance rms^2 exp(-d^2 / (2 L^2)) of points d apart:
///
///   f(x) = rms / sqrt(M) sum_m r_m cos(w_m . x + phi_m)
///
/// It consists of M = 1024 waves. The components of w_m are normal of deviation 1 / L, r_m^2 / 2 is exponential and
/// phi_m uniform. So each wave is the sum of a cosine and a sine with independent normal weights.
///
/// Over the seeds the value at a point is exactly normal and the covariance exact. A difference of two values has a
/// kurtosis of 3 (1 + (1 + rho)^2 / (2 M)), rho their correlation: below 3.006. The covariance of one seed's waves,
/// taken over r and phi, is off by rms^2 (1 - exp(-d^2 / L^2)) / sqrt(2 M) (one deviation). This is 2.2 % of rms^2 at
/// most. The gradient's components have the deviation rms / L.
///
/// source   Rahimi and Recht, Random features for large-scale kernel machines, NIPS 2007; Box and Muller 1958
class RandomField {
 public:
  /// rms           [m]
  /// correlation   L [m], > 0
  /// seed          the same seed gives the same field on every machine, but for the rounding of log and cos
  RandomField(double rms, double correlation, std::uint64_t seed);

  /// n values [m] at 3 x n points [m].
  Eigen::VectorXd at(const Points& points) const;

 private:
  Points wavevectors_;         // 3 x M [rad/m]
  Eigen::ArrayXd phases_;      // [rad]
  Eigen::ArrayXd amplitudes_;  // [m]
};

}  // namespace touchfield
