#include "sim/run/motion_summary.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numeric>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include "sim/core/units.h"
#include "sim/run/text_table.h"

namespace touchfield {

std::vector<std::string> stages_of(const std::vector<StageSeconds>& all) {
  std::vector<std::string> stages;
  for (const StageSeconds& one : all) {
    for (const auto& [stage, seconds] : one) {
      if (std::ranges::find(stages, stage) == stages.end()) {
        stages.push_back(stage);
      }
    }
  }
  return stages;
}

std::vector<std::string> stages_of(const std::vector<MotionFrame>& frames) {
  std::vector<StageSeconds> all;
  std::ranges::transform(frames, std::back_inserter(all), &MotionFrame::seconds);
  return stages_of(all);
}

double stage_seconds(const StageSeconds& stages, const std::string& stage) {
  const auto found = std::ranges::find(stages, stage, &std::pair<std::string, double>::first);
  return found == stages.end() ? kNotComputed : found->second;
}

namespace {

Worst worst_of(double Metrics::*metric) {
  const bool more_is_better = metric == &Metrics::correlation || metric == &Metrics::mean_inside_pa ||
                              metric == &Metrics::reached_share || metric == &Metrics::force_target_n;
  return more_is_better ? Worst::kSmallest : Worst::kLargest;
}

std::string in_ms(double seconds) { return table_number(1e3 * seconds, "{:.1f}"); }

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

double shown_displacement(const MotionScore& score) {
  return score.frame < 0 ? kNotComputed : score.displacement.norm();
}

std::vector<int> spread_numbers(int of, int most) {
  const int count = std::min(of, most);
  std::vector<int> numbers;
  for (int i = 0; i < count; ++i) {
    numbers.push_back(static_cast<int>((2LL * i + 1) * of / (2LL * count)));
  }
  return numbers;
}

std::vector<MotionInstant> some_instants(const Motion& motion, int most) {
  std::vector<MotionInstant> some;
  for (const int number : spread_numbers(static_cast<int>(motion.instants.size()), most)) {
    some.push_back(motion.instants[static_cast<std::size_t>(number)]);
  }
  return some;
}

double percentile(std::vector<double> values, double share) {
  if (values.empty()) {
    return kNotComputed;
  }
  const double place = share * static_cast<double>(values.size() - 1);
  const auto low = values.begin() + static_cast<std::ptrdiff_t>(std::floor(place));
  std::nth_element(values.begin(), low, values.end());
  const double part = place - std::floor(place);
  return part > 0 ? *low + part * (*std::min_element(low + 1, values.end()) - *low) : *low;
}

Statistics statistics(std::vector<double> values, Worst worst) {
  std::erase_if(values, [](double value) { return std::isnan(value); });
  if (values.empty()) {
    return {};
  }
  const auto [least, most] = std::ranges::minmax(values);
  return {.count = static_cast<int>(values.size()),
          .mean = std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size()),
          .median = percentile(values, 0.5),
          .p95 = percentile(values, 0.95),
          .worst = worst == Worst::kLargest ? most : least};
}

MotionSummary summary(const MotionMethod& method) {
  MotionSummary result;
  result.frames = static_cast<int>(method.frames.size());
  result.dropped = method.dropped;
  result.scores = static_cast<int>(method.scores.size());
  std::vector<double> latencies;
  std::vector<double> seconds;
  for (const MotionFrame& frame : method.frames) {
    result.silent += frame.silent ? 1 : 0;
    result.lost += frame.lost ? 1 : 0;
    result.late += frame.late > 0 ? 1 : 0;
    latencies.push_back(frame.shown - frame.sampled);
    if (!frame.silent) {
      seconds.push_back(std::accumulate(frame.seconds.begin(), frame.seconds.end(), 0.0,
                                        [](double sum, const auto& stage) { return sum + stage.second; }));
    }
  }
  result.latency = statistics(std::move(latencies));
  result.frame_seconds = statistics(std::move(seconds));
  const auto over_scores = [&](const auto& value, Worst worst = Worst::kLargest) {
    std::vector<double> values;
    std::ranges::transform(method.scores, std::back_inserter(values), value);
    return statistics(std::move(values), worst);
  };
  result.displacement = over_scores(shown_displacement);
  result.age = over_scores(&MotionScore::age);
  for (const MetricField& field : metric_fields()) {
    result.metrics.push_back(over_scores(
        [value = field.value](const MotionScore& score) { return score.metrics.*value; }, worst_of(field.value)));
  }
  return result;
}

const Statistics& statistics_of(const MotionSummary& summary, double Metrics::*metric) {
  const auto place = std::ranges::find(metric_fields(), metric, &MetricField::value) - metric_fields().begin();
  return summary.metrics.at(static_cast<std::size_t>(place));
}

std::vector<std::pair<std::string, double>> summary_columns(const MotionSummary& summary) {
  std::vector<std::pair<std::string, double>> columns;
  const auto add = [&](const std::string& name, const Statistics& values) {
    columns.emplace_back(name + "_mean", values.mean);
    columns.emplace_back(name + "_median", values.median);
    columns.emplace_back(name + "_p95", values.p95);
    columns.emplace_back(name + "_worst", values.worst);
    columns.emplace_back(name + "_count", values.count);
  };
  for (std::size_t i = 0; i < metric_fields().size(); ++i) {
    add(metric_fields()[i].name, summary.metrics.at(i));
  }
  add("displacement_m", summary.displacement);
  add("age_s", summary.age);
  add("latency_s", summary.latency);
  add("frame_seconds", summary.frame_seconds);
  columns.emplace_back("frames", summary.frames);
  columns.emplace_back("silent", summary.silent);
  columns.emplace_back("lost", summary.lost);
  columns.emplace_back("late", summary.late);
  columns.emplace_back("dropped", summary.dropped);
  columns.emplace_back("scores", summary.scores);
  return columns;
}

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
  std::vector<StageSeconds> all;
  for (const MotionMethod& method : motion.methods) {
    std::ranges::transform(method.frames, std::back_inserter(all), &MotionFrame::seconds);
  }
  const std::vector<std::string> stages = stages_of(all);
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
  std::vector<std::vector<std::string>> rows = {{"method", "error [%]", "of P [%]", "mean [Pa]", "off [mm]", "age [ms]",
                                                 "frame [ms]", "frames", "late", "dropped"}};
  for (const MotionMethod& method : motion.methods) {
    const MotionSummary over = summary(method);
    rows.push_back({method.name, both(statistics_of(over, &Metrics::relative_error), 1e2, "{:.1f}"),
                    both(statistics_of(over, &Metrics::relative_error_radiation), 1e2, "{:.1f}"),
                    table_number(statistics_of(over, &Metrics::mean_inside_pa).median, "{:.0f}"),
                    both(over.displacement, 1e3, "{:.2f}"), both(over.age, 1e3, "{:.0f}"),
                    both(over.frame_seconds, 1e3, "{:.0f}"), fmt::to_string(over.frames), fmt::to_string(over.late),
                    fmt::to_string(over.dropped)});
  }
  return aligned_table(rows) + "  a | b: median and 95th percentile\n";
}

Json motion_value(const Motion& motion) {
  const TriangleMesh& evaluation = evaluated_mesh(motion);
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

std::string motion_report(const Motion& motion, const std::string& results) {
  return "<h2>Results</h2>\n<pre>" + markup_text(results.empty() ? motion_table(motion) : results) + "</pre>\n" +
         remarks_markup(motion.warnings, motion.notes) + provenance_markup(motion.provenance);
}

}  // namespace touchfield
