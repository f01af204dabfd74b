#include "sim/store/motion_text.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "sim/core/units.h"
#include "sim/core/utf8.h"
#include "sim/store/motion_stages.h"
#include "sim/store/motion_summary.h"
#include "sim/store/result_text.h"
#include "sim/store/run_file.h"
#include "sim/store/text_table.h"

namespace touchfield {

namespace {

std::string in_ms(double seconds) { return table_number(1e3 * seconds, "{:.1f}"); }

/// Those of all methods, in the order in which they first appear.
std::vector<std::string> all_stages(const Motion& motion) {
  std::vector<std::string> all;
  for (const MotionMethod& method : motion.methods) {
    for (const std::string& stage : stages_of(method.frames)) {
      if (std::ranges::find(all, stage) == all.end()) {
        all.push_back(stage);
      }
    }
  }
  return all;
}

std::string method_text(const MotionMethod& method) {
  const MotionSummary over = summary(method);
  std::string text = fmt::format(
      "method    {}: {}{}, {} frames ({} quiet, {} of them lost, {} late), {} dropped, {} scores; sample to array: "
      "median {} ms, 95 % "
      "{} ms, worst {} ms\n",
      method.name, method.method, method.scheme.empty() ? "" : " by " + method.scheme, over.frames, over.quiet,
      over.lost, over.late, over.dropped, over.scores, in_ms(over.latency.median), in_ms(over.latency.p95),
      in_ms(over.latency.worst));
  std::vector<std::string> stages;
  for (const std::string& stage : stages_of(method.frames)) {
    std::vector<double> seconds;
    std::ranges::transform(method.frames, std::back_inserter(seconds),
                           [&](const MotionFrame& frame) { return stage_seconds(frame, stage); });
    const Statistics over_frames = statistics(std::move(seconds));
    stages.push_back(fmt::format("{} {} ({})", stage, in_ms(over_frames.median), in_ms(over_frames.p95)));
  }
  return stages.empty()
             ? text
             : text + fmt::format("stages    {}: {} ms, median (95 %)\n", method.name, fmt::join(stages, ", "));
}

}  // namespace

void write_motion_csv(const std::string& path, const Motion& motion) {
  std::vector<std::string> header = {"method", "time_s", "frame",           "age_s",      "dx_mm",
                                     "dy_mm",  "dz_mm",  "displacement_mm", "judged_skin"};
  for (const MetricField& field : metric_fields()) {
    header.emplace_back(field.name);
  }
  std::string text = csv_line(header);
  for (const MotionMethod& method : motion.methods) {
    for (const MotionScore& score : method.scores) {
      std::vector<std::string> line = {method.name, csv_number(score.time), fmt::to_string(score.frame),
                                       csv_number(score.age)};
      for (int i = 0; i < 3; ++i) {
        line.push_back(csv_number(score.frame < 0 ? kNotComputed : 1e3 * score.displacement[i]));
      }
      line.push_back(csv_number(1e3 * shown_displacement(score)));
      line.push_back(to_string(motion.judged_skin));
      for (const MetricField& field : metric_fields()) {
        line.push_back(csv_number(score.metrics.*field.value));
      }
      text += csv_line(line);
    }
  }
  write_text_file(path, text);
}

void write_frames_csv(const std::string& path, const Motion& motion) {
  std::vector<std::string> header = {"method",       "frame",         "sampled_s", "started_s", "late_s",
                                     "shown_s",      "pose_time_s",   "quiet",     "lost",      "skin_off_mm",
                                     "patch_off_mm", "target_off_mm", "cost",      "steps",     "status"};
  const std::vector<std::string> stages = all_stages(motion);
  for (const std::string& stage : stages) {
    header.push_back("seconds_" + stage);
  }
  std::string text = csv_line(header);
  for (const MotionMethod& method : motion.methods) {
    for (std::size_t i = 0; i < method.frames.size(); ++i) {
      const MotionFrame& frame = method.frames[i];
      const PhaseSolution& solution = frame.solution;
      std::vector<std::string> line = {method.name, fmt::to_string(i)};
      for (const double time : {frame.sampled, frame.started, frame.late, frame.shown, frame.pose_time}) {
        line.push_back(csv_number(time));
      }
      line.emplace_back(frame.quiet ? "1" : "0");
      line.emplace_back(frame.lost ? "1" : "0");
      line.push_back(csv_number(frame.off.skin / kMillimetre));
      line.push_back(csv_number(frame.off.patch / kMillimetre));
      line.push_back(csv_number(frame.target_off / kMillimetre));
      line.push_back(csv_number(solution.cost_history.empty() ? kNotComputed : solution.cost_history.back()));
      line.push_back(fmt::to_string(solution.iterations));
      line.push_back(to_string(solution.status));
      for (const std::string& stage : stages) {
        line.push_back(csv_number(stage_seconds(frame, stage)));
      }
      text += csv_line(line);
    }
  }
  write_text_file(path, text);
}

std::string motion_table(const Motion& motion) {
  std::vector<std::vector<std::string>> rows = {{"method", "error: median", "95 %", "worst", "inside [Pa]", "reached",
                                                 "off [mm]: median", "95 %", "age [ms]: median", "95 %",
                                                 "frame [ms]: median", "95 %", "frames", "late", "dropped"}};
  for (const MotionMethod& method : motion.methods) {
    const MotionSummary over = summary(method);
    const Statistics& error = statistics_of(over, &Metrics::relative_error);
    rows.push_back({method.name, percent_text(error.median), percent_text(error.p95), percent_text(error.worst),
                    table_number(statistics_of(over, &Metrics::mean_inside_pa).median, "{:.0f}"),
                    percent_text(statistics_of(over, &Metrics::reached_share).median),
                    table_number(1e3 * over.displacement.median, "{:.2f}"),
                    table_number(1e3 * over.displacement.p95, "{:.2f}"), in_ms(over.age.median), in_ms(over.age.p95),
                    in_ms(over.frame_seconds.median), in_ms(over.frame_seconds.p95), fmt::to_string(over.frames),
                    fmt::to_string(over.late), fmt::to_string(over.dropped)});
  }
  return label_line(motion.judged_skin) + aligned_table(rows);
}

std::string describe_motion(const Motion& motion) {
  std::string text = fmt::format("{}: a motion of {:.6g} s, {}\n", one_line(motion.name), motion.seconds,
                                 motion.complete ? "complete" : "NOT COMPLETE");
  text += "mesh      " + mesh_size_text(motion.mesh);
  text += motion.judge ? "judge     " + mesh_size_text(*motion.judge) : "judge     on the solving mesh\n";
  text += array_line(motion.array);
  for (const MotionMethod& method : motion.methods) {
    text += method_text(method);
  }
  for (const auto& [stage, seconds] : motion.timings) {
    text += fmt::format("seconds   {}: {:.3f}\n", stage, seconds);
  }
  text += provenance_text(motion.provenance) + remarks_text(motion.warnings, motion.notes);
  return text + (motion.methods.empty() ? "no method has started\n" : '\n' + motion_table(motion));
}

}  // namespace touchfield
