#pragma once

#include <limits>
#include <span>
#include <string>

#include "sim/core/types.h"

/// How far apart two lists of values are that should be the same. In all of them a value that is the same in both, bit
/// for bit or NaN in both, counts as no difference; lists that cannot be compared are infinitely far apart.
namespace touchfield {

inline constexpr double kInfinite = std::numeric_limits<double>::infinity();

/// True for equal bits, and for two NaN.
bool same_value(double a, double b);

/// |a - b| / max(|a|, |b|); 0 for the same value, infinite if only one of them is finite.
double relative_change(double a, double b);

/// Difference of plain numbers.
struct NumbersDifference {
  bool identical = true;  // bit for bit; NaN equals NaN
  double relative = 0.0;  // largest |a - b| over the largest |a| or |b|
  std::string fault;      // why they cannot be compared; empty: they can
};

NumbersDifference compare_numbers(std::span<const double> a, std::span<const double> b);

/// Difference of complex amplitudes, as they are and after the one phase that brings b nearest to a.
///
///   turn = arg sum w conj(a) b,   relative = sqrt(sum w |b exp(-i turn) - a|^2 / max(sum w |a|^2, sum w |b|^2))
struct ComplexDifference {
  bool identical = true;
  double relative = 0.0;  // after the turn, 0 to sqrt(2)
  double as_is = 0.0;     // without it, 0 to 2
  double turn = 0.0;      // [rad], by which b is ahead of a
  std::string fault;
};

/// weights   one a value, >= 0, e.g. areas; empty: all alike
ComplexDifference compare_complex(const Eigen::VectorXcd& a, const Eigen::VectorXcd& b, const Eigen::VectorXd& weights);

/// Difference of the phases of drives, wrapped to -pi..pi, after the one phase that brings the drives of b nearest to
/// those of a.
struct PhasesDifference {
  bool identical = true;
  double largest = 0.0;  // [rad]
  double rms = 0.0;      // [rad]
  double turn = 0.0;     // [rad], by which b is ahead of a
  std::string fault;
};

/// phases       [rad], one a channel
/// amplitudes   one a channel; the phase of a channel that is silent in both does not count
PhasesDifference compare_phases(const Eigen::VectorXd& phases_a, const Eigen::VectorXd& amplitudes_a,
                                const Eigen::VectorXd& phases_b, const Eigen::VectorXd& amplitudes_b);

}  // namespace touchfield
