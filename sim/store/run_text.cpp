#include <algorithm>
#include <cmath>
#include <iterator>
#include <string_view>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "sim/core/atomic_file.h"
#include "sim/core/units.h"
#include "sim/core/utf8.h"
#include "sim/store/result_text.h"
#include "sim/store/run_file.h"
#include "sim/store/run_layout.h"
#include "sim/store/text_table.h"

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

/// How the channels differ from their design; empty if they do not.
std::string channels_text(const Run& run) {
  if (!run.array_truth) {
    return run.array.response.as_designed() ? "" : fmt::format("channels  {}\n", response_text(run.array.response));
  }
  const int levels = run.array_truth->phase_levels;
  return fmt::format("channels  the solver's: {}\nchannels  the true ones: {}{}\n", response_text(run.array.response),
                     response_text(run.array_truth->response),
                     levels == 0 ? "" : fmt::format(", {} phase levels", levels));
}

std::string fields_text(const Run& run) {
  std::string text;
  for (const FieldResult& field : run.fields) {
    const FieldGrid& grid = field.grid;
    std::vector<std::string> methods;
    std::ranges::transform(field.pressure, std::back_inserter(methods), [](const auto& entry) { return entry.first; });
    text += fmt::format("field     {}: {} x {} x {} points, {}\n", grid.name, grid.count[0], grid.count[1],
                        grid.count[2], methods.empty() ? "no pressure" : fmt::format("{}", fmt::join(methods, ", ")));
  }
  return text;
}

std::string counted(long n, std::string_view noun) {
  return fmt::format("{} {}{}", grouped(n), noun, n == 1 ? "" : "s");
}

std::string judge_line(const Run& run) {
  if (!run.judge_model) {
    return run.judge == "none" ? "judge     none\n" : "judge     same: the solving model\n";
  }
  const TriangleMesh& mesh = run.judge_model->mesh;
  return fmt::format("judge     {}: {}, {} faces, mean edge {:.3g} mm\n", run.judge, run.judge_model->scheme,
                     mesh.face_count(), 1e3 * mesh.mean_edge());
}

std::string solve_line(const SolveRecord& solve) {
  std::string how = solve.steps > 0 ? counted(solve.steps, "step") + ", " : "";
  if (solve.refinements > 0) {
    how += counted(solve.refinements, "refinement") + ", ";
  }
  const std::string where = solve.device.empty() || solve.device == "cpu" ? "" : " on " + solve.device;
  return fmt::format("solve     {}: {}, {}{}, {}, {}, {}: {}residual {}, {:.3g} s{}\n", solve.stage, solve.scheme,
                     solve.solver, where, solve.precision, counted(solve.unknowns, "unknown"),
                     counted(solve.right_hand_sides, "right-hand side"), how, table_number(solve.residual, "{:.1e}"),
                     solve.seconds, solve.converged ? "" : ", NOT CONVERGED");
}

}  // namespace

std::string markup_text(const std::string& text) {
  std::string escaped;
  for (const char c : text) {
    escaped += c == '&' ? "&amp;" : c == '<' ? "&lt;" : c == '"' ? "&quot;" : std::string(1, c);
  }
  return escaped;
}

std::string label_line(SkinExtent extent) {
  const std::string label = extent_label(extent);
  return label.empty() ? "" : label + '\n';
}

std::string percent_text(double fraction) { return table_number(100.0 * fraction, "{:.2f} %"); }

std::string array_line(const TransducerArray& array) {
  if (array.kind == TransducerArray::Kind::kPlaneWave) {
    return fmt::format("array     plane wave of {:.6g} Pa\n", array.amplitudes(0));
  }
  const int devices = array.device.size() == 0 ? 0 : *std::ranges::max_element(array.device) + 1;
  return fmt::format("array     {} transducers on {} device{}, directivity {}\n", array.size(), devices,
                     devices == 1 ? "" : "s", directivity_name(array.directivity.kind()));
}

std::string mesh_size_text(const TriangleMesh& mesh) {
  return fmt::format("{} faces, {} vertices, {:.4g} cm2, mean edge {:.3g} mm\n", mesh.face_count(), mesh.vertex_count(),
                     1e4 * mesh.total_area(), 1e3 * mesh.mean_edge());
}

std::string provenance_text(const Provenance& provenance) {
  const std::string period = provenance.end.empty() ? provenance.start + ", not ended"
                                                    : fmt::format("{} to {}", provenance.start, provenance.end);
  std::string text = fmt::format("made by   touchfield {} ({}), {}, {}\n", provenance.version, provenance.revision,
                                 provenance.compiler, provenance.flags);
  const std::string kernels =
      provenance.blas_core.empty()
          ? ""
          : fmt::format(", BLAS core {}, loops {}", provenance.blas_core, provenance.instruction_level);
  text += fmt::format("on        {}, {}{}\n", provenance.machine, counted(provenance.threads, "thread"), kernels);
  text += provenance.card.empty() ? "" : fmt::format("card      {}\n", provenance.card);
  text += fmt::format("when      {}\n", period);
  text += fmt::format("command   {}\n", one_line(provenance.command_line));
  if (!provenance.seeds.empty()) {
    text += fmt::format("seeds     {}\n", provenance.seeds);
  }
  text += fmt::format("scene     {}\n", provenance.scene_hash);
  return text;
}

std::string remarks_text(const std::vector<std::string>& warnings, const std::vector<std::string>& notes) {
  std::string text;
  for (const std::string& warning : warnings) {
    text += fmt::format("warning   {}\n", one_line(warning));
  }
  for (const std::string& note : notes) {
    text += fmt::format("note      {}\n", one_line(note));
  }
  return text;
}

std::string methods_table(const Run& run) {
  const auto certified = [](const MethodResult& result) { return !std::isnan(result.metrics.optimality_gap); };
  const bool with_gap = std::ranges::any_of(run.methods, certified);
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
  return label_line(run.judged_skin) + aligned_table(rows) + pressure;
}

std::string describe_run(const Run& run) {
  std::string text = fmt::format("{}: {}\n", one_line(run.name), run.complete ? "complete" : "NOT COMPLETE");
  text += "mesh      " + mesh_size_text(run.mesh);
  text += array_line(run.array);
  text += channels_text(run);
  text += run.target ? fmt::format("target    {} faces, up to {:.6g} Pa\n", run.target->size(),
                                   *std::ranges::max_element(run.target->amplitudes))
                     : "target    none\n";
  text += judge_line(run);
  text += fields_text(run);
  for (const RunTransfer& transfer : run.transfers) {
    text += fmt::format("transfer  {}: {} and {} outside the target, {}\n", transfer.scheme,
                        counted(transfer.problem.target_count(), "target row"),
                        counted(transfer.problem.quiet.rows(), "row"),
                        counted(transfer.problem.channel_count(), "channel"));
  }
  for (const SolveRecord& solve : run.solves) {
    text += solve_line(solve);
  }
  for (const MethodResult& method : run.methods) {
    text += fmt::format("method    {}: {}, {}\n", method.name, counted(method.solution.iterations, "step"),
                        to_string(method.solution.status));
  }
  if (!std::isnan(run.alarm)) {
    text += fmt::format("alarm     conventional and Burton-Miller pressures differ by {}\n", percent_text(run.alarm));
  }
  for (const auto& [scheme, alarm] : run.alarms) {
    text += fmt::format("alarm     {} and Burton-Miller differ by {}\n", scheme, percent_text(alarm));
  }
  for (const auto& [stage, seconds] : run.seconds) {
    text += fmt::format("seconds   {}: {:.3f}\n", stage, seconds);
  }
  text += provenance_text(run.provenance) + remarks_text(run.warnings, run.notes);
  return text + (run.methods.empty() ? "no method has finished\n" : '\n' + methods_table(run));
}

void write_metrics_csv(const std::string& path, const Run& run) {
  std::vector<std::string> header = {"name", "method", "scheme", "judged_skin"};
  for (const MetricField& field : metric_fields()) {
    header.emplace_back(field.name);
  }
  header.emplace_back("status");
  std::string text = csv_line(header);
  for (const MethodResult& result : run.methods) {
    std::vector<std::string> line = {result.name, result.method, result.scheme, to_string(run.judged_skin)};
    for (const MetricField& field : metric_fields()) {
      line.push_back(csv_number(result.metrics.*field.value));
    }
    line.push_back(to_string(result.solution.status));
    text += csv_line(line);
  }
  write_text_file(path, text);
}

void write_text_file(const std::string& path, const std::string& text) { write_atomically(path, {text}); }

}  // namespace touchfield
