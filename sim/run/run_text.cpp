#include "sim/run/run_text.h"

#include <algorithm>
#include <cmath>
#include <iterator>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include "sim/core/files.h"
#include "sim/core/units.h"
#include "sim/core/version.h"
#include "sim/field/metrics.h"
#include "sim/run/run_text.h"
#include "sim/run/text_table.h"
#include "solvers/phase/phase_methods.h"

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

Json method_row(const MethodResult& method) {
  Json value = {{"name", method.name}, {"method", method.method}, {"scheme", method.scheme}};
  for (const MetricField& field : metric_fields()) {
    value[field.name] = method.metrics.*field.value;
  }
  value.update({{"shock_distance_share", method.shock_distance_share}, {"status", to_string(method.solution.status)}});
  return value;
}

/// A share as "12.3 %"; "-" where nothing was computed.
std::string percent_text(double fraction) { return table_number(100.0 * fraction, "{:.1f} %"); }

/// Method names stand in results as scenes give them; this is what the program calls what they do.
std::string help_of(const std::string& method) {
  const std::span<const PhaseMethod> all = phase_methods();
  const auto found = std::ranges::find(all, method, &PhaseMethod::name);
  return found == all.end() ? "" : std::string(found->help);
}

std::string array_sentence(const Run& run) {
  const TransducerArray& array = run.array;
  const std::string sound = array.kind == TransducerArray::Kind::kPlaneWave
                                ? fmt::format("The sound was a plane wave of {:.4g} Pa", array.amplitudes(0))
                                : fmt::format("The array consisted of {} transducers (directivity {})", array.size(),
                                              directivity_name(array.directivity.kind()));
  return sound + (std::isnan(run.frequency) ? ". " : fmt::format(" at {:.4g} kHz. ", 1e-3 * run.frequency));
}

/// "5,456 triangular faces (mean edge 6.63 mm, 1.50 mm on the target)".
std::string faces_text(const TriangleMesh& mesh, const std::optional<Target>& target) {
  std::string on_target;
  if (target && target->size() > 0) {
    const TriangleMesh patch(mesh.vertices(), mesh.triangles()(Eigen::all, target->faces));
    on_target = fmt::format(", {:.2f} mm on the target", patch.mean_edge() / kMillimetre);
  }
  return fmt::format("{} triangular faces (mean edge {:.2f} mm{})", grouped(mesh.face_count()),
                     mesh.mean_edge() / kMillimetre, on_target);
}

std::string evaluation_sentence(const Run& run) {
  if (run.evaluation_model) {
    return fmt::format("All phases were evaluated on a separate mesh of {}. ",
                       faces_text(run.evaluation_model->mesh, run.evaluation_model->target));
  }
  return run.evaluation == "none" ? "" : "All phases were evaluated on the mesh that they were found on. ";
}

/// What a solve is for; empty of the resonance check, which changes no result.
std::string purpose(const SolveRecord& solve) {
  return solve.stage.starts_with("resonance_check") ? ""
         : solve.stage.starts_with("transfer")      ? "the transfer matrix"
         : solve.stage.starts_with("evaluation")    ? "the evaluation"
                                                    : "the pressures of the methods";
}

/// How the systems of each purpose were solved, with the largest residual among their solves.
std::string scattering_sentence(const Run& run) {
  std::vector<std::pair<std::string, double>> told;
  for (const SolveRecord& solve : run.solves) {
    if (const std::string what = purpose(solve); !what.empty()) {
      const std::string text =
          fmt::format("{} by scheme {} ({}, {} precision", what, solve.scheme, solve.solver, solve.precision);
      const auto same = std::ranges::find(told, text, [](const auto& entry) { return entry.first; });
      if (same == told.end()) {
        told.emplace_back(text, solve.residual);
      } else {
        same->second = std::fmax(same->second, solve.residual);
      }
    }
  }
  std::string text;
  for (const auto& [what, residual] : told) {
    text += (text.empty() ? "Scattering by the sound-hard skin was computed by boundary elements: " : "; ") + what +
            (std::isnan(residual) ? ")" : fmt::format(", largest relative residual {:.1e})", residual));
  }
  return text.empty() ? "" : text + ". ";
}

std::string cell(const std::string& text, const char* tag = "td") {
  return fmt::format("<{0}>{1}</{0}>", tag, markup_text(text));
}

std::string figures_of(const Run& run) {
  std::string text = "<table><tr>";
  for (const char* head : {"method", "error [%]", "mean in target [Pa]", "width [mm]", "leakage [%]", "error of P [%]",
                           "width of P [mm]", "length of P [mm]", "force [mN]", "outside [mN]", "loudest outside"}) {
    text += cell(head, "th");
  }
  text += "</tr>\n";
  for (const MethodResult& result : run.methods) {
    const Metrics& metrics = result.metrics;
    text += "<tr>" + cell(result.name) + cell(table_number(1e2 * metrics.relative_error, "{:.1f}")) +
            cell(table_number(metrics.mean_inside_pa, "{:.0f}")) + cell(table_number(metrics.width_mm, "{:.2f}")) +
            cell(table_number(1e2 * metrics.leakage, "{:.0f}")) +
            cell(table_number(1e2 * metrics.relative_error_radiation, "{:.1f}")) +
            cell(table_number(metrics.width_radiation_mm, "{:.2f}")) +
            cell(table_number(metrics.length_radiation_mm, "{:.2f}")) +
            cell(table_number(1e3 * metrics.force_target_n, "{:.3g}")) +
            cell(table_number(1e3 * metrics.abs_force_elsewhere_n, "{:.3g}")) +
            cell(table_number(metrics.loudest_elsewhere, "{:.2f}")) + "</tr>\n";
  }
  return text + "</table>\n";
}

std::string list_of(const char* title, const std::vector<std::string>& lines) {
  std::string text;
  for (const std::string& line : lines) {
    text += "<li>" + markup_text(line) + "</li>\n";
  }
  return text.empty() ? "" : fmt::format("<h2>{}</h2>\n<ul>\n{}</ul>\n", title, text);
}

/// The paragraph alone, as plain text.
std::string methods_paragraph(const Run& run) {
  std::string text = fmt::format("{} was a mesh of {}. ",
                                 run.solved_skin == SkinExtent::kPart ? "The skin near the target" : "The skin",
                                 faces_text(run.mesh, run.target));
  text += array_sentence(run) + scattering_sentence(run);
  if (run.target) {
    const double largest = run.target->amplitudes.maxCoeff();
    text +=
        fmt::format("The target was a pressure of up to {:.4g} Pa (a radiation pressure of {:.3g} Pa) on {} faces. ",
                    largest, run.radiation_per_square * largest * largest, run.target->size());
  }
  for (const MethodResult& result : run.methods) {
    text += fmt::format("Method {} ({}): {} ", result.name, result.scheme, help_of(result.method));
  }
  return text + evaluation_sentence(run) +
         fmt::format("Computed with touchfield {} ({}).", run.provenance.version, run.provenance.revision);
}

/// This version of touchfield, and the paper on which its method is based.
std::string bibtex(const std::string& version) {
  return "@software{touchfield,\n  title = {touchfield},\n  author = {{The touchfield authors}},\n  year = {" +
         build_info().year + "},\n  version = {" + version +
         "}\n}\n"
         "@inproceedings{matsubayashi2020rendering,\n"
         "  title = {Rendering Ultrasound Pressure Distribution on Hand Surface in Real-Time},\n"
         "  author = {Matsubayashi, Atsushi and Makino, Yasutoshi and Shinoda, Hiroyuki},\n"
         "  booktitle = {Haptics: Science, Technology, Applications (EuroHaptics 2020)},\n"
         "  year = {2020},\n  doi = {10.1007/978-3-030-58147-3_45}\n}\n";
}

}  // namespace

std::string markup_text(const std::string& text) {
  std::string escaped;
  for (const char c : text) {
    escaped += c == '&' ? "&amp;" : c == '<' ? "&lt;" : c == '"' ? "&quot;" : std::string(1, c);
  }
  return escaped;
}

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
  const auto gap = [](const MethodResult& result) {
    const Metrics& metrics = result.metrics;
    return std::isnan(metrics.cost_radiation) ? metrics.optimality_gap : metrics.optimality_gap_radiation;
  };
  const bool with_gap =
      std::ranges::any_of(run.methods, [&](const MethodResult& result) { return !std::isnan(gap(result)); });
  std::vector<std::vector<std::string>> rows = {
      {"method", "error", "of P", "reached", "width", "length", "force", "outside", "loudest", "seconds"}};
  if (with_gap) {
    rows.front().emplace_back("gap");
  }
  std::string extent;
  for (const MethodResult& result : run.methods) {
    const Metrics& metrics = result.metrics;
    if (!std::isnan(metrics.width_wanted_mm)) {
      extent = fmt::format(", {:.2f} x {:.2f} mm", metrics.width_wanted_mm, metrics.length_wanted_mm);
    }
    rows.push_back(
        {result.name, percent_text(metrics.relative_error), percent_text(metrics.relative_error_radiation),
         table_number(1e2 * metrics.reached_share, "{:.0f} %"), table_number(metrics.width_radiation_mm, "{:.1f}"),
         table_number(metrics.length_radiation_mm, "{:.1f}"), table_number(1e3 * metrics.force_target_n, "{:.3g} mN"),
         table_number(1e3 * metrics.abs_force_elsewhere_n, "{:.3g} mN"),
         table_number(metrics.loudest_elsewhere, "{:.2f}"), table_number(metrics.seconds_total, "{:.1f}")});
    if (with_gap) {
      rows.back().push_back(percent_text(gap(result)));
    }
  }
  std::string wanted;
  if (run.target) {
    const bool best = std::ranges::any_of(run.seconds, [](const auto& stage) { return stage.first == kScaleStage; });
    const double largest = run.target->amplitudes.maxCoeff();
    wanted =
        "of P, the radiation pressure: error, width and length [mm], force, sum and loudest outside\n" +
        fmt::format("wanted: {:.4g} Pa, P {:.3g} Pa{}{}\n", largest, run.radiation_per_square * largest * largest,
                    extent, best ? fmt::format("; the amplitude that {} fits best", run.methods.front().name) : "");
  }
  return aligned_table(rows) + wanted;
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
  std::ranges::transform(run.methods, std::back_inserter(methods), method_row);
  return methods;
}

std::string describe_run(const Run& run) {
  return lines_text(run_value(run)) + (run.methods.empty() ? "no method has finished\n" : '\n' + methods_table(run));
}

void write_metrics_csv(const std::string& path, const Run& run) {
  const auto row_of = [](const MethodResult& result) {
    Json row = method_row(result);
    row.erase("shock_distance_share");
    return row;
  };
  Json rows = Json::array();
  std::ranges::transform(run.methods, std::back_inserter(rows), row_of);
  write_text_file(path, csv_text(row_of({}), rows));
}

std::string remarks_markup(const std::vector<std::string>& warnings, const std::vector<std::string>& notes) {
  return list_of("Warnings", warnings) + list_of("Notes", notes);
}

std::string provenance_markup(const Provenance& provenance) {
  return fmt::format("<h2>To cite</h2>\n<pre>{}</pre>\n<h2>Provenance</h2>\n<pre>{}</pre>\n",
                     markup_text(bibtex(provenance.version)), markup_text(lines_text(provenance_value(provenance))));
}

std::string run_report(const Run& run) {
  const std::string levels = levels_text(run);
  return fmt::format("<h2>Results</h2>\n{}{}{}<h2>For a methods section</h2>\n<p>{}</p>\n{}", figures_of(run),
                     levels.empty() ? "" : "<h2>Sound levels</h2>\n<pre>" + markup_text(levels) + "</pre>\n",
                     remarks_markup(run.warnings, run.notes), markup_text(methods_paragraph(run)),
                     provenance_markup(run.provenance));
}

}  // namespace touchfield
