#include <algorithm>
#include <cmath>
#include <iterator>
#include <string_view>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include "sim/core/files.h"
#include "sim/core/units.h"
#include "sim/field/metrics.h"
#include "sim/run/result_text.h"
#include "sim/run/run_file.h"
#include "sim/run/run_layout.h"
#include "sim/run/text_table.h"

namespace touchfield {

namespace {

/// What channels respond with, those that are alive.
std::string response_text(const ChannelResponse& response) {
  const Eigen::ArrayXd alive = (response.gain.array() > 0).cast<double>();
  const double count = alive.sum();
  if (response.as_designed() || count == 0) {
    return response.as_designed() ? "as designed" : "all dead";
  }
  const double mean = response.gain.sum() / count;
  const double gain = std::sqrt((alive * (response.gain.array() - mean).square()).sum() / count);
  const double phase = std::sqrt((alive * response.phase.array().square()).sum() / count);
  return fmt::format("gain {:.3f} +- {:.3f}, phase {:.3g} deg rms, {:.0f} of {} dead", mean, gain, phase / kDegree,
                     static_cast<double>(response.gain.size()) - count, response.gain.size());
}

Json field_values(const Run& run) {
  Json fields = Json::object();
  for (const FieldResult& field : run.fields) {
    const FieldGrid& grid = field.grid;
    if (grid.size() == 1) {
      continue;  // levels_value has it
    }
    std::vector<std::string> methods;
    std::ranges::transform(field.pressure, std::back_inserter(methods), [](const auto& entry) { return entry.first; });
    fields[grid.name] = fmt::format("{} x {} x {} points, {}", grid.count[0], grid.count[1], grid.count[2],
                                    methods.empty() ? "no pressure" : fmt::format("{}", fmt::join(methods, ", ")));
  }
  return fields;
}

Json transfer_values(const Run& run) {
  Json transfers = Json::array();
  for (const RunTransfer& transfer : run.transfers) {
    transfers.push_back(Json{{"scheme", transfer.scheme},
                             {"target_rows", transfer.problem.target_count()},
                             {"rows_outside", transfer.problem.outside.rows()},
                             {"channels", transfer.problem.channel_count()}});
  }
  return transfers;
}

Json solve_values(const Run& run) {
  Json solves = Json::array();
  for (const SolveRecord& solve : run.solves) {
    solves.push_back(Json{{"stage", solve.stage},
                          {"scheme", solve.scheme},
                          {"solver", solve.solver},
                          {"device", solve.device == "cpu" ? "" : solve.device},
                          {"precision", solve.precision},
                          {"unknowns", solve.unknowns},
                          {"right_sides", solve.right_hand_sides},
                          {"steps", solve.steps},
                          {"refinements", solve.refinements},
                          {"residual", solve.residual},
                          {"converged", solve.converged},
                          {"seconds", solve.seconds}});
  }
  return solves;
}

}  // namespace

std::string markup_text(const std::string& text) {
  std::string escaped;
  for (const char c : text) {
    escaped += c == '&' ? "&amp;" : c == '<' ? "&lt;" : c == '"' ? "&quot;" : std::string(1, c);
  }
  return escaped;
}

std::string percent_text(double fraction) { return table_number(100.0 * fraction, "{:.2f} %"); }

std::string array_text(const TransducerArray& array) {
  if (array.kind == TransducerArray::Kind::kPlaneWave) {
    return fmt::format("plane wave of {:.6g} Pa", array.amplitudes(0));
  }
  const int devices = array.device.size() == 0 ? 0 : *std::ranges::max_element(array.device) + 1;
  return fmt::format("{} transducers on {} device{}, directivity {}", array.size(), devices, devices == 1 ? "" : "s",
                     directivity_name(array.directivity.kind()));
}

Json mesh_size(const TriangleMesh& mesh) {
  return {{"faces", mesh.face_count()},
          {"vertices", mesh.vertex_count()},
          {"area_cm2", 1e4 * mesh.total_area()},
          {"mean_edge_mm", mesh.mean_edge() / kMillimetre}};
}

Json provenance_value(const Provenance& provenance) {
  Json value = Json::object();
  for (const ProvenanceField& field : provenance_fields()) {
    value[field.name] = provenance.*field.value;
  }
  value["threads"] = provenance.threads;
  return value;
}

Json stage_values(const std::vector<std::pair<std::string, double>>& stages) {
  Json group = Json::object();
  for (const auto& [stage, value] : stages) {
    group[stage] = value;
  }
  return group;
}

std::string methods_table(const Run& run) {
  const auto bounded = [](const MethodResult& result) { return !std::isnan(result.metrics.optimality_gap); };
  const bool with_gap = std::ranges::any_of(run.methods, bounded);
  std::vector<std::vector<std::string>> rows = {
      {"method", "error", "mean [Pa]", "reached", "width [mm]", "leakage", "force [mN]", "seconds"}};
  if (with_gap) {
    rows.front().emplace_back("gap");
  }
  for (const MethodResult& result : run.methods) {
    const Metrics& metrics = result.metrics;
    rows.push_back({result.name, percent_text(metrics.relative_error), table_number(metrics.mean_inside_pa, "{:.0f}"),
                    percent_text(metrics.reached_share),
                    table_number(metrics.width_mm, "{:.2f}") +
                        (std::isnan(metrics.width_wanted_mm) ? "" : fmt::format(" of {:.2f}", metrics.width_wanted_mm)),
                    percent_text(metrics.leakage), table_number(1e3 * metrics.force_target_n, "{:.3g}"),
                    table_number(metrics.seconds_total, "{:.1f}")});
    if (with_gap) {
      rows.back().push_back(percent_text(metrics.optimality_gap));
    }
  }
  const bool best = std::ranges::any_of(run.seconds, [](const auto& stage) { return stage.first == kScaleStage; });
  const std::string pressure = best && run.target
                                   ? fmt::format("wanted: {:.4g} Pa, where {} fits best\n",
                                                 run.target->amplitudes.maxCoeff(), run.methods.front().name)
                                   : "";
  return aligned_table(rows) + pressure;
}

Json run_value(const Run& run) {
  Json ends = Json::object();
  for (const MethodResult& method : run.methods) {
    ends[method.name] = fmt::format("{} steps, {}", method.solution.iterations, to_string(method.solution.status));
  }
  const EvaluationModel* const model = run.evaluation_model ? &*run.evaluation_model : nullptr;
  Json resonance_checks = Json::object();
  for (const auto& [scheme, resonance_check] : run.resonance_checks) {
    resonance_checks[scheme] = resonance_check;
  }
  Json value = {{"name", run.name},
                {"complete", run.complete},
                {"faces", run.mesh.face_count()},
                {"mesh", mesh_size(run.mesh)},
                {"array", array_text(run.array)},
                {"channels", run.array.size()},
                {"response", response_text(run.array.response)},
                {"true_response", run.array_truth ? response_text(run.array_truth->response) : ""},
                {"true_phase_levels", run.array_truth ? Json(run.array_truth->phase_levels) : Json()},
                {"target_faces", run.target ? run.target->size() : 0},
                {"target_pa", run.target ? Json(run.target->amplitudes.maxCoeff()) : Json()},
                {"solved_skin", to_string(run.solved_skin)},
                {"evaluation", run.evaluation},
                {"evaluation_scheme", model != nullptr ? model->scheme : ""},
                {"evaluation_mesh", model != nullptr ? mesh_size(model->mesh) : Json()},
                {"fields", field_values(run)},
                {"transfers", transfer_values(run)},
                {"solves", solve_values(run)},
                {"method_ends", ends},
                {"resonance_check", std::isnan(run.resonance_check) ? Json() : Json(run.resonance_check)},
                {"resonance_checks", resonance_checks},
                {"seconds", stage_values(run.seconds)}};
  value.update(levels_value(run));
  value.update(provenance_value(run.provenance));
  value.update({{"warnings", run.warnings}, {"notes", run.notes}});
  return value;
}

Json levels_value(const Run& run) {
  Json levels = Json::array();
  for (const FieldResult& field : run.fields) {
    for (const auto& [method, pressure] : field.pressure) {
      if (field.grid.size() == 1) {
        const double amplitude = field.inside.front() == 0 ? std::abs(pressure(0)) : kNotComputed;
        levels.push_back(Json{{"point", field.grid.name},
                              {"method", method},
                              {"amplitude_pa", amplitude},
                              {"level_db", sound_level(amplitude)}});
      }
    }
  }
  Json limits = Json::array();
  for (const ExposureLimit& limit : exposure_limits(levels.empty() ? kNotComputed : run.frequency)) {
    limits.push_back(Json{{"source", limit.source}, {"for", limit.people}, {"limit_db", limit.level}});
  }
  return {{"sound_levels", levels}, {"exposure_limits", limits}};
}

std::string levels_text(const Run& run) {
  const Json values = levels_value(run);
  const Json& levels = values["sound_levels"];
  const Json& limits = values["exposure_limits"];
  if (levels.empty()) {
    return "";
  }
  const std::string text =
      "sound levels, dB re 20 uPa rms, of the carrier at full amplitude, without the listener's head\n" +
      table_text(levels, levels.size());
  return limits.empty()
             ? text + fmt::format("no published limit is known here for {:.4g} kHz\n", 1e-3 * run.frequency)
             : text +
                   fmt::format("published limits in the third-octave band of {:.4g} kHz; no assessment of safety\n",
                               1e-3 * run.frequency) +
                   table_text(limits);
}

Json method_values(const Run& run) {
  Json methods = Json::array();
  for (const MethodResult& method : run.methods) {
    Json value = {{"name", method.name}, {"method", method.method}, {"scheme", method.scheme}};
    for (const MetricField& field : metric_fields()) {
      value[field.name] = method.metrics.*field.value;
    }
    value.update(
        {{"shock_distance_share", method.shock_distance_share}, {"status", to_string(method.solution.status)}});
    methods.push_back(value);
  }
  return methods;
}

std::string describe_run(const Run& run) {
  return lines_text(run_value(run)) + (run.methods.empty() ? "no method has finished\n" : '\n' + methods_table(run));
}

void write_metrics_csv(const std::string& path, const Run& run) {
  const auto row_of = [&](const MethodResult& result) {
    Json row = {{"name", result.name}, {"method", result.method}, {"scheme", result.scheme}};
    for (const MetricField& field : metric_fields()) {
      row[field.name] = result.metrics.*field.value;
    }
    row["status"] = to_string(result.solution.status);
    return row;
  };
  Json rows = Json::array();
  std::ranges::transform(run.methods, std::back_inserter(rows), row_of);
  write_text_file(path, csv_text(row_of({}), rows));
}

void write_text_file(const std::string& path, const std::string& text) { write_atomically(path, {text}); }

}  // namespace touchfield
