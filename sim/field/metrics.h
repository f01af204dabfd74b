#pragma once

#include <limits>
#include <string>
#include <vector>

namespace touchfield {

inline constexpr double kNotComputed = std::numeric_limits<double>::quiet_NaN();

/// What a method reached. docs/metrics.md defines each; NaN where not computed.
struct Metrics {
  double relative_error = kNotComputed;      // after the best scale
  double relative_error_raw = kNotComputed;  // at scale 1
  double scale = kNotComputed;               // the best scale
  double correlation = kNotComputed;
  double leakage = kNotComputed;  // share of sum A |p|^2 outside the target
  double mean_inside_pa = kNotComputed;
  double reached_share = kNotComputed;  // mean_inside_pa over the mean that is wanted there
  double cv_inside = kNotComputed;      // standard deviation over mean of |p| inside
  double width_mm = kNotComputed;
  double width_wanted_mm = kNotComputed;
  double peak_pa = kNotComputed;
  double force_target_n = kNotComputed;
  double force_elsewhere_n = kNotComputed;
  double cost = kNotComputed;        // the method's own, at its end
  double cost_skin = kNotComputed;   // surface's, at the method's best common level up to 1
  double cost_bound = kNotComputed;  // the least that surface's can be at full level
  double optimality_gap = kNotComputed;
  double error_bound = kNotComputed;  // sqrt(cost_bound / cost of silence)
  double power_share = kNotComputed;  // mean of the squares of the drives' amplitudes
  double iterations = kNotComputed;
  double seconds_solve = kNotComputed;
  double seconds_total = kNotComputed;
  double evaluation_difference = kNotComputed;         // from the evaluation, over the skin
  double evaluation_difference_target = kNotComputed;  // and over the target's surroundings
};

/// A metric's name as results spell it, its unit ("1" if none) and where it is kept.
struct MetricField {
  const char* name;
  const char* unit;
  double Metrics::*value;
  bool share = false;  // of a whole, which people read in percent
};

/// Every metric in the order of the results' columns. (`status` is text and kept with the solution.)
const std::vector<MetricField>& metric_fields();

}  // namespace touchfield
