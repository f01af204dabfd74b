#pragma once

#include <string>
#include <utility>
#include <vector>

#include "sim/core/json.h"
#include "sim/run/motion_data.h"
#include "sim/run/run_text.h"

/// What files, tables and pictures of a motion read off its frames and scores.
namespace touchfield {

/// All stages, in the order in which they first appear.
std::vector<std::string> stages_of(const std::vector<StageSeconds>& all);
std::vector<std::string> stages_of(const std::vector<MotionFrame>& frames);

/// How long a stage took [s]; NaN if there was none.
double stage_seconds(const StageSeconds& stages, const std::string& stage);
inline double stage_seconds(const MotionFrame& frame, const std::string& stage) {
  return stage_seconds(frame.seconds, stage);
}

/// How far the target's patch is from where the shown frame's sample has it [m]; NaN while the array shows no frame.
double shown_displacement(const MotionScore& score);

/// Ascending numbers of so many from 0, at most `most` of them, evenly: floor((i + 1/2) of / count).
std::vector<int> spread_numbers(int of, int most);

std::vector<MotionInstant> some_instants(const Motion& motion, int most);

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

const Statistics& statistics_of(const MotionSummary& summary, double Metrics::*metric);

/// The summary as columns of a table: NAME_mean, NAME_median, NAME_p95, NAME_worst and NAME_count of every metric, of
/// displacement_m, age_s, latency_s and frame_seconds, then frames, silent, lost, late, dropped and scores.
std::vector<std::pair<std::string, double>> summary_columns(const MotionSummary& summary);

/// motion.csv: a header line and one line per score and method: method, time_s, frame, age_s, dx_mm, dy_mm, dz_mm,
/// displacement_mm, every metric. NaN is written as "nan"; displacements are NaN while the array shows no
/// frame. Whole or not at all.
void write_motion_csv(const std::string& path, const Motion& motion);

/// frames.csv: a header line and one line per frame and method. Whole or not at all. Its columns:
///
///   method, frame, sampled_s, started_s, late_s, shown_s, pose_time_s
///   silent, lost                   0 or 1
///   skin_off_mm, patch_off_mm     SkinOff
///   target_off_mm
///   cost                          after the last step
///   steps, status
///   seconds_STAGE                 for every stage
void write_frames_csv(const std::string& path, const Motion& motion);

/// The methods side by side, one per line: error over the motion, level, displacement and age of what is felt, frames.
/// If the scores are of a part of the body, its label comes first.
std::string motion_table(const Motion& motion);

/// motion_value has the meshes, array and provenance of a motion, method_values its methods with the columns of their
/// summary. describe_motion is text for a person. It has the former, the methods with their frames, latencies and
/// stages, and motion_table.
Json motion_value(const Motion& motion);
Json method_values(const Motion& motion);
std::string describe_motion(const Motion& motion);

/// What the page of a motion says below its pictures, in HTML: results, warnings and notes, what to cite, provenance.
///
/// results   text; empty: motion_table
std::string motion_report(const Motion& motion, const std::string& results = "");

}  // namespace touchfield
