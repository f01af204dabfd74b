#pragma once

#include <string>
#include <utility>
#include <vector>

#include "sim/run/motion_data.h"

namespace touchfield {

/// What became of a number over a motion. NaN is left out; where nothing is left all but `count` are NaN.
struct Statistics {
  int count = 0;  // of the values that are numbers
  double mean = kNotComputed;
  double median = kNotComputed;
  double p95 = kNotComputed;    // 95th percentile
  double worst = kNotComputed;  // the largest, or the smallest where more is better
};

enum class Worst { kLargest, kSmallest };

/// The value below which a share of the values lies, 0 <= share <= 1. It is at place share (n - 1) of the n values in
/// ascending order, linear between two of them. A share of 0.5 thus gives the usual median. NaN if there are no values.
double percentile(std::vector<double> values, double share);

/// Mean, median, 95th percentile and worst of values, without those that are NaN.
Statistics statistics(std::vector<double> values, Worst worst = Worst::kLargest);

/// One method over a motion in numbers. The worst of a metric is its largest value over the scores. For correlation,
/// mean_inside_pa, reached_share and force_target_n it is the smallest. The 95th percentile of a metric is always the
/// value that 95 % do not exceed.
struct MotionSummary {
  int frames = 0;
  int silent = 0;   // of them
  int lost = 0;     // of those, because the sensor did not know where the hand was
  int late = 0;     // of them, those that did not start at their turn
  int dropped = 0;  // turns at which the solver was still busy
  int scores = 0;
  std::vector<Statistics> metrics{};  // over the scores, in the order of metric_fields()
  Statistics displacement{};          // of the target's patch since its sample, its length, over scores of a frame [m]
  Statistics age{};                   // of what is felt, over scores of a frame [s]
  Statistics latency{};               // from sample to array, over frames [s]
  Statistics frame_seconds{};         // that a frame took, all its stages, over frames that are not silent [s]
};

MotionSummary summary(const MotionMethod& method);

/// The statistics of a metric by its member.
const Statistics& statistics_of(const MotionSummary& summary, double Metrics::*metric);

/// The summary as columns of a table: NAME_mean, NAME_median, NAME_p95, NAME_worst and NAME_count of every metric, of
/// displacement_m, age_s, latency_s and frame_seconds, then frames, silent, lost, late, dropped and scores.
std::vector<std::pair<std::string, double>> summary_columns(const MotionSummary& summary);

}  // namespace touchfield
