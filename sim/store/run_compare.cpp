#include "sim/store/run_compare.h"

#include <algorithm>
#include <iterator>
#include <set>
#include <span>
#include <string_view>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "sim/store/run_layout.h"
#include "sim/store/run_verdict.h"

namespace touchfield {

namespace {

std::span<const double> numbers(const Eigen::VectorXd& values) {
  return {values.data(), static_cast<std::size_t>(values.size())};
}

OnlyIn unshared(const std::set<std::string>& a, const std::set<std::string>& b) {
  OnlyIn only;
  std::ranges::set_difference(a, b, std::back_inserter(only.a));
  std::ranges::set_difference(b, a, std::back_inserter(only.b));
  return only;
}

template <class List, class Name>
std::set<std::string> names_of(const List& list, const Name& name) {
  std::set<std::string> names;
  std::ranges::transform(list, std::inserter(names, names.end()), name);
  return names;
}

std::vector<TextChange> compare_provenance(const Provenance& a, const Provenance& b) {
  std::vector<TextChange> changes;
  for (const ProvenanceField& field : provenance_fields()) {
    const std::string_view name = field.name;
    if (name != "start" && name != "end") {
      add_change(changes, field.name, a.*field.value, b.*field.value);
    }
  }
  add_change(changes, "threads", fmt::to_string(a.threads), fmt::to_string(b.threads));
  return changes;
}

JudgeDifference compare_judges(const Run& a, const Run& b) {
  JudgeDifference result;
  add_change(result.texts, "judge", a.judge, b.judge);
  if (a.judge_model && b.judge_model) {
    add_change(result.texts, "scheme", a.judge_model->scheme, b.judge_model->scheme);
    result.mesh = compare_meshes(a.judge_model->mesh, b.judge_model->mesh);
    result.target = compare_targets(a.judge_model->target, b.judge_model->target);
  }
  return result;
}

/// How a stage's system was solved, where that differs.
std::vector<TextChange> compare_solvers(const std::vector<SolveRecord>& a, const std::vector<SolveRecord>& b) {
  const auto how = [](const SolveRecord& solve) { return fmt::format("{}, {}", solve.solver, solve.precision); };
  std::vector<TextChange> changes;
  std::set<std::string> seen;
  for (const SolveRecord& solve : a) {
    const auto other = std::ranges::find(b, solve.stage, &SolveRecord::stage);
    if (other != b.end() && seen.insert(solve.stage).second) {
      add_change(changes, solve.stage, how(solve), how(*other));
    }
  }
  return changes;
}

/// The judge's pressure of a method; where the judge is the solving model that may be the method's own.
const Eigen::VectorXcd& judged_pressure(const MethodResult& method, const Run& run) {
  return method.judge_pressure.size() == 0 && run.judge == "same" ? method.pressure : method.judge_pressure;
}

Eigen::VectorXd weights_of(const TriangleMesh& mesh, const Eigen::VectorXcd& pressure) {
  return mesh.face_count() == pressure.size() ? mesh.areas() : Eigen::VectorXd();
}

/// One of the two runs, and what it says of a method.
struct MethodOf {
  const Run& run;
  const MethodResult& method;
};

MethodDifference compare_methods(const MethodOf& of_a, const MethodOf& of_b) {
  const MethodResult& a = of_a.method;
  const MethodResult& b = of_b.method;
  MethodDifference result;
  result.name = a.name;
  add_change(result.texts, "method", a.method, b.method);
  add_change(result.texts, "scheme", a.scheme, b.scheme);
  add_change(result.texts, "status", to_string(a.solution.status), to_string(b.solution.status));
  result.phases = compare_phases(a.solution.phases, a.solution.amplitudes, b.solution.phases, b.solution.amplitudes);
  result.amplitudes = compare_numbers(numbers(a.solution.amplitudes), numbers(b.solution.amplitudes));
  result.pressure = compare_complex(a.pressure, b.pressure, weights_of(of_a.run.mesh, a.pressure));
  if (a.judge_pressure.size() > 0 || b.judge_pressure.size() > 0) {
    const Eigen::VectorXcd& judged = judged_pressure(a, of_a.run);
    const TriangleMesh& mesh = of_a.run.judge_model ? of_a.run.judge_model->mesh : of_a.run.mesh;
    result.judge_pressure = compare_complex(judged, judged_pressure(b, of_b.run), weights_of(mesh, judged));
  }
  result.cost_length = {a.solution.cost_history.size(), b.solution.cost_history.size()};
  result.cost = compare_numbers(a.solution.cost_history, b.solution.cost_history);
  result.identical = result.texts.empty() && result.phases.identical && result.amplitudes.identical &&
                     result.pressure.identical && (!result.judge_pressure || result.judge_pressure->identical) &&
                     result.cost.identical && a.solution.iterations == b.solution.iterations;
  for (const MetricField& field : metric_fields()) {
    const bool is_time = std::string_view(field.unit) == "s";
    const double value_a = a.metrics.*field.value;
    const double value_b = b.metrics.*field.value;
    auto& list = is_time ? result.seconds : result.metrics;
    list.push_back({field.name, value_a, value_b, relative_change(value_a, value_b)});
    result.identical = result.identical && (is_time || same_value(value_a, value_b));
  }
  return result;
}

std::string grid_fault(const FieldGrid& a, const FieldGrid& b) {
  if (a.count != b.count) {
    return fmt::format("{} and {} points", fmt::join(a.count, " x "), fmt::join(b.count, " x "));
  }
  return a.origin == b.origin && a.spacing == b.spacing ? "" : "its points are at other places";
}

FieldDifference compare_fields(const FieldResult& a, const FieldResult& b) {
  FieldDifference result;
  result.name = a.grid.name;
  result.points = a.inside.size();
  result.fault = grid_fault(a.grid, b.grid);
  if (!result.fault.empty()) {
    result.identical = false;
    return result;
  }
  for (std::size_t i = 0; i < a.inside.size(); ++i) {
    result.inside += a.inside[i] != b.inside[i] ? 1U : 0U;
  }
  result.identical = result.inside == 0;
  for (const auto& [method, pressure] : a.pressure) {
    for (const auto& [other, other_pressure] : b.pressure) {
      if (method == other) {
        result.pressure.emplace_back(method, compare_complex(pressure, other_pressure, {}));
        result.identical = result.identical && result.pressure.back().second.identical;
      }
    }
  }
  return result;
}

}  // namespace

std::string to_string(Verdict verdict) {
  switch (verdict) {
    case Verdict::kIdentical:
      return "identical";
    case Verdict::kRounding:
      return "same_to_rounding";
    case Verdict::kDifferent:
      return "different";
  }
  return "";
}

RunDifference compare_runs(const Run& a, const Run& b, std::vector<TextChange> scene) {
  RunDifference result;
  result.complete = {a.complete, b.complete};
  result.provenance = compare_provenance(a.provenance, b.provenance);
  result.scene = std::move(scene);
  result.mesh = compare_meshes(a.mesh, b.mesh);
  result.array = compare_arrays(a.array, b.array);
  result.target = compare_targets(a.target, b.target);
  result.judge = compare_judges(a, b);
  result.solvers = compare_solvers(a.solves, b.solves);
  // A warning's name is the word before its first colon; the rest holds figures.
  const auto warning_name = [](const std::string& warning) { return warning.substr(0, warning.find(':')); };
  result.warnings = unshared(names_of(a.warnings, warning_name), names_of(b.warnings, warning_name));
  const auto method_name = [](const MethodResult& method) { return method.name; };
  result.methods = unshared(names_of(a.methods, method_name), names_of(b.methods, method_name));
  for (const MethodResult& method : a.methods) {
    const auto other = std::ranges::find(b.methods, method.name, &MethodResult::name);
    if (other != b.methods.end()) {
      result.both_methods.push_back(compare_methods({a, method}, {b, *other}));
    }
  }
  const auto field_name = [](const FieldResult& field) { return field.grid.name; };
  result.fields = unshared(names_of(a.fields, field_name), names_of(b.fields, field_name));
  for (const FieldResult& field : a.fields) {
    const auto other = std::ranges::find(b.fields, field.grid.name, field_name);
    if (other != b.fields.end()) {
      result.both_fields.push_back(compare_fields(field, *other));
    }
  }
  conclude(result, a, b);
  return result;
}

}  // namespace touchfield
