#include "sim/run/motion_text.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include "sim/core/units.h"
#include "sim/run/motion_stages.h"
#include "sim/run/motion_summary.h"
#include "sim/run/result_text.h"
#include "sim/run/run_file.h"
#include "sim/run/text_table.h"

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

/// Counts and times of a method, and what its frames took by stage: the median, and the 95th percentile.
Json method_value(const MotionMethod& method) {
  const MotionSummary over = summary(method);
  std::vector<std::string> stages;
  for (const std::string& stage : stages_of(method.frames)) {
    std::vector<double> seconds;
    std::ranges::transform(method.frames, std::back_inserter(seconds),
                           [&](const MotionFrame& frame) { return stage_seconds(frame, stage); });
    const Statistics over_frames = statistics(std::move(seconds));
    stages.push_back(fmt::format("{} {} ({})", stage, in_ms(over_frames.median), in_ms(over_frames.p95)));
  }
  return {{"name", method.name},
          {"method", method.method},
          {"scheme", method.scheme},
          {"frames", over.frames},
          {"silent", over.silent},
          {"lost", over.lost},
          {"late", over.late},
          {"dropped", over.dropped},
          {"scores", over.scores},
          {"latency_ms", fmt::format("{} ({}), worst {}", in_ms(over.latency.median), in_ms(over.latency.p95),
                                     in_ms(over.latency.worst))},
          {"stages_ms", fmt::format("{}", fmt::join(stages, ", "))}};
}

}  // namespace

void write_motion_csv(const std::string& path, const Motion& motion) {
  const auto row_of = [&](const MotionMethod& method, const MotionScore& score) {
    const Vector3 moved = score.frame < 0 ? Vector3::Constant(kNotComputed) : Vector3(1e3 * score.displacement);
    Json row = {{"method", method.name}, {"time_s", score.time},
                {"frame", score.frame},  {"age_s", score.age},
                {"dx_mm", moved.x()},    {"dy_mm", moved.y()},
                {"dz_mm", moved.z()},    {"displacement_mm", 1e3 * shown_displacement(score)}};
    for (const MetricField& field : metric_fields()) {
      row[field.name] = score.metrics.*field.value;
    }
    return row;
  };
  Json rows = Json::array();
  for (const MotionMethod& method : motion.methods) {
    for (const MotionScore& score : method.scores) {
      rows.push_back(row_of(method, score));
    }
  }
  write_text_file(path, csv_text(row_of({}, {}), rows));
}

void write_frames_csv(const std::string& path, const Motion& motion) {
  const std::vector<std::string> stages = all_stages(motion);
  const auto row_of = [&](const MotionMethod& method, const MotionFrame& frame) {
    const PhaseSolution& solution = frame.solution;
    Json row = {{"method", method.name},
                {"frame", &frame - method.frames.data()},
                {"sampled_s", frame.sampled},
                {"started_s", frame.started},
                {"late_s", frame.late},
                {"shown_s", frame.shown},
                {"pose_time_s", frame.pose_time},
                {"silent", frame.silent},
                {"lost", frame.lost},
                {"skin_off_mm", frame.off.skin / kMillimetre},
                {"patch_off_mm", frame.off.patch / kMillimetre},
                {"target_off_mm", frame.target_off / kMillimetre},
                {"cost", solution.cost_history.empty() ? kNotComputed : solution.cost_history.back()},
                {"steps", solution.iterations},
                {"status", to_string(solution.status)}};
    for (const std::string& stage : stages) {
      row["seconds_" + stage] = stage_seconds(frame, stage);
    }
    return row;
  };
  MotionMethod none;
  none.frames.emplace_back();
  Json rows = Json::array();
  for (const MotionMethod& method : motion.methods) {
    for (const MotionFrame& frame : method.frames) {
      rows.push_back(row_of(method, frame));
    }
  }
  write_text_file(path, csv_text(row_of(none, none.frames.front()), rows));
}

std::string motion_table(const Motion& motion) {
  const auto both = [](const Statistics& of, double factor, const char* format) {
    return table_number(factor * of.median, format) + " | " + table_number(factor * of.p95, format);
  };
  std::vector<std::vector<std::string>> rows = {
      {"method", "error [%]", "mean [Pa]", "off [mm]", "age [ms]", "frame [ms]", "frames", "late", "dropped"}};
  for (const MotionMethod& method : motion.methods) {
    const MotionSummary over = summary(method);
    rows.push_back({method.name, both(statistics_of(over, &Metrics::relative_error), 1e2, "{:.1f}"),
                    table_number(statistics_of(over, &Metrics::mean_inside_pa).median, "{:.0f}"),
                    both(over.displacement, 1e3, "{:.2f}"), both(over.age, 1e3, "{:.0f}"),
                    both(over.frame_seconds, 1e3, "{:.0f}"), fmt::to_string(over.frames), fmt::to_string(over.late),
                    fmt::to_string(over.dropped)});
  }
  return aligned_table(rows) + "  a | b: median and 95th percentile\n";
}

Json motion_value(const Motion& motion) {
  const TriangleMesh& evaluation = motion.evaluation ? *motion.evaluation : motion.mesh;
  Json value = {{"name", motion.name},
                {"complete", motion.complete},
                {"seconds", motion.seconds},
                {"faces", motion.mesh.face_count()},
                {"mesh", mesh_size(motion.mesh)},
                {"evaluation_faces", evaluation.face_count()},
                {"evaluation", motion.evaluation ? "a mesh of its own" : "on the solving mesh"},
                {"evaluation_mesh", mesh_size(evaluation)},
                {"channels", motion.array.size()},
                {"array", array_text(motion.array)},
                {"solved_skin", to_string(motion.solved_skin)}};
  value.update(provenance_value(motion.provenance));
  value.update({{"timings_s", stage_values(motion.timings)}, {"warnings", motion.warnings}, {"notes", motion.notes}});
  return value;
}

Json method_values(const Motion& motion) {
  Json methods = Json::array();
  for (const MotionMethod& method : motion.methods) {
    Json value = {{"name", method.name}, {"method", method.method}, {"scheme", method.scheme}};
    for (const auto& [name, number] : summary_columns(summary(method))) {
      value[name] = number;
    }
    methods.push_back(value);
  }
  return methods;
}

std::string describe_motion(const Motion& motion) {
  Json value = motion_value(motion);
  Json methods = Json::array();
  std::ranges::transform(motion.methods, std::back_inserter(methods), method_value);
  value["methods"] = methods;
  return lines_text(value) + (methods.empty() ? "no method has started\n" : '\n' + motion_table(motion));
}

}  // namespace touchfield
