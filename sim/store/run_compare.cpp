#include "sim/store/run_compare.h"

#include <algorithm>
#include <iterator>
#include <set>
#include <string_view>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "sim/store/run_layout.h"

namespace touchfield {

namespace {

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

/// The arrays with what they really do.
ArrayDifference compare_run_arrays(const Run& a, const Run& b) {
  const auto response = [](const Run& run) { return run.array_truth ? run.array_truth->response : run.array.response; };
  const auto levels = [](const Run& run) { return run.array_truth ? run.array_truth->phase_levels : 0; };
  ArrayDifference result = compare_arrays(a.array, b.array);
  result.true_responses = compare_responses(response(a), a.array.size(), response(b), b.array.size());
  add_change(result.texts, "phase_levels", fmt::to_string(levels(a)), fmt::to_string(levels(b)));
  const bool same_levels = levels(a) == levels(b);
  result.identical = result.identical && same_levels && result.true_responses.identical;
  result.relative = same_levels ? std::max(result.relative, result.true_responses.relative) : kInfinite;
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

constexpr double kRounding = 1e-6;
constexpr double kSingleRounding = 1e-4;

/// What has been looked at so far.
class Tally {
 public:
  void model(const std::string& what, bool identical, double relative) { add(what, identical, relative, false); }
  void result(const std::string& what, bool identical, double relative) { add(what, identical, relative, true); }

  bool identical() const { return identical_; }
  const Deviation& largest() const { return largest_; }
  const Deviation& largest_result() const { return largest_result_; }

 private:
  void add(const std::string& what, bool identical, double relative, bool is_result) {
    identical_ = identical_ && identical;
    if (relative > largest_.relative) {
      largest_ = {what, relative};
    }
    if (is_result && relative > largest_result_.relative) {
      largest_result_ = {what, relative};
    }
  }

  bool identical_ = true;
  Deviation largest_;
  Deviation largest_result_;
};

void add_models(Tally& tally, const RunDifference& difference) {
  const bool same_skin = difference.judged_skin.first == difference.judged_skin.second;
  tally.model("the skin that is evaluated", same_skin, same_skin ? 0.0 : kInfinite);
  tally.model("the mesh", difference.mesh.identical, difference.mesh.relative);
  tally.model("the array", difference.array.identical, difference.array.relative);
  tally.model("the target", difference.target.identical, difference.target.relative);
  const JudgeDifference& judge = difference.judge;
  tally.model("the judge", judge.texts.empty(), judge.texts.empty() ? 0.0 : kInfinite);
  if (judge.mesh) {
    tally.model("the judge's mesh", judge.mesh->identical, judge.mesh->relative);
    tally.model("the judge's target", judge.target->identical, judge.target->relative);
  }
}

void add_unshared(Tally& tally, const char* noun, const OnlyIn& only) {
  for (const auto& [names, run] : {std::pair{&only.a, 'A'}, std::pair{&only.b, 'B'}}) {
    for (const std::string& name : *names) {
      tally.result(fmt::format("{} {} is in {} alone", noun, name, run), false, kInfinite);
    }
  }
}

void add_method(Tally& tally, const MethodDifference& method) {
  tally.result("phases of " + method.name, method.identical, method.phases.largest);
  tally.result("amplitudes of " + method.name, method.identical, method.amplitudes.relative);
  tally.result("pressure of " + method.name, method.identical, method.pressure.relative);
  if (method.judge_pressure) {
    tally.result("judge's pressure of " + method.name, method.identical, method.judge_pressure->relative);
  }
  for (const NumberPair& metric : method.metrics) {
    tally.result(fmt::format("{} of {}", metric.name, method.name), method.identical, metric.relative);
  }
}

void add_field(Tally& tally, const FieldDifference& field) {
  const double inside = field.inside == 0 ? 0.0 : static_cast<double>(field.inside) / static_cast<double>(field.points);
  tally.result(fmt::format("field {}: its grid", field.name), field.identical, field.fault.empty() ? 0.0 : kInfinite);
  tally.result(fmt::format("field {}: the points inside bodies", field.name), field.identical, inside);
  for (const auto& [method, pressure] : field.pressure) {
    tally.result(fmt::format("field {} of {}", field.name, method), field.identical, pressure.relative);
  }
}

bool solved_in_single(const Run& run) {
  return std::ranges::any_of(run.solves, [](const SolveRecord& solve) { return solve.precision == "single"; });
}

/// Keys that name a run and choose its files change no number.
bool bears_on_results(const TextChange& change) {
  const std::string_view first = std::string_view(change.what).substr(0, change.what.find_first_of(".["));
  return first != "name" && first != "write";
}

std::string scene_cause(const std::vector<TextChange>& scene) {
  constexpr std::size_t kNamed = 3;
  std::vector<std::string> keys;
  for (const TextChange& change : scene) {
    if (bears_on_results(change)) {
      keys.push_back(change.what);
    }
  }
  if (keys.empty()) {
    return "";
  }
  const std::size_t more = keys.size() > kNamed ? keys.size() - kNamed : 0;
  keys.resize(keys.size() - more);
  return fmt::format("the scene: {}{}", fmt::join(keys, ", "), more == 0 ? "" : fmt::format(" and {} more", more));
}

/// The changes among those of these names, as one cause; empty if there is none.
std::string recorded_cause(const std::vector<TextChange>& changes, const char* noun,
                           std::initializer_list<std::string_view> names) {
  std::vector<std::string> found;
  for (const std::string_view name : names) {
    const auto change = std::ranges::find(changes, name, &TextChange::what);
    if (change != changes.end()) {
      found.push_back(fmt::format("{} -> {}", *change->a, *change->b));
    }
  }
  return found.empty() ? "" : fmt::format("{}: {}", noun, fmt::join(found, ", "));
}

/// What a scene reads from files, whose contents no run records, where it may have made the difference.
std::string file_cause(const RunDifference& difference, const std::string& scene) {
  const auto names = [&](const char* key) { return scene.find(key) != std::string::npos; };
  if (!(difference.mesh.identical && difference.array.identical) && names(" file: ")) {
    return "a mesh or a table of positions that the scene names";
  }
  return names(" phases_file: ") || names(" previous: ") ? "the phases that the scene reads from a file" : "";
}

std::vector<std::string> likely_causes(const RunDifference& difference, const Run& a, const Run& b) {
  std::vector<std::string> causes;
  const auto add = [&](const std::string& cause) {
    if (!cause.empty()) {
      causes.push_back(cause);
    }
  };
  if (a.complete != b.complete) {
    add(fmt::format("{} is not complete", a.complete ? "B" : "A"));
  }
  add(scene_cause(difference.scene.changes));
  add(recorded_cause(difference.provenance, "the program", {"version", "revision"}));
  add(recorded_cause(difference.provenance, "the build", {"compiler", "flags"}));
  add(file_cause(difference, a.scene));
  for (const TextChange& change : difference.solvers) {
    add(fmt::format("the solver of {}: {} -> {}", change.what, *change.a, *change.b));
  }
  add(recorded_cause(difference.provenance, "threads", {"threads"}));
  add(recorded_cause(difference.provenance, "the machine", {"machine", "blas_core", "instruction_level", "card"}));
  if (a.provenance.revision == b.provenance.revision && a.provenance.revision.ends_with("-dirty")) {
    add(fmt::format("the program: {} may be two programs, because its sources were not committed",
                    a.provenance.revision));
  }
  if (causes.empty() && difference.verdict == Verdict::kDifferent) {
    add("nothing that is recorded; two runs of one program and one scene should not differ this much");
  }
  return causes;
}

/// Fills in what a difference comes to: verdict, rounding, the largest deviations and the likely causes.
void conclude(RunDifference& difference, const Run& a, const Run& b) {
  Tally tally;
  add_models(tally, difference);
  add_unshared(tally, "method", difference.methods);
  add_unshared(tally, "field", difference.fields);
  for (const MethodDifference& method : difference.both_methods) {
    add_method(tally, method);
  }
  for (const FieldDifference& field : difference.both_fields) {
    add_field(tally, field);
  }
  difference.rounding = solved_in_single(a) || solved_in_single(b) ? kSingleRounding : kRounding;
  difference.largest = tally.largest();
  difference.largest_result = tally.largest_result();
  difference.verdict = tally.identical()                                 ? Verdict::kIdentical
                       : tally.largest().relative <= difference.rounding ? Verdict::kRounding
                                                                         : Verdict::kDifferent;
  if (difference.verdict != Verdict::kIdentical) {
    difference.causes = likely_causes(difference, a, b);
  }
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

RunDifference compare_runs(const Run& a, const Run& b, SceneDifference scene) {
  RunDifference result;
  result.complete = {a.complete, b.complete};
  result.judged_skin = {a.judged_skin, b.judged_skin};
  result.provenance = compare_provenance(a.provenance, b.provenance);
  result.scene = std::move(scene);
  result.mesh = compare_meshes(a.mesh, b.mesh);
  result.array = compare_run_arrays(a, b);
  result.target = compare_targets(a.target, b.target);
  result.judge = compare_judges(a, b);
  result.solvers = compare_solvers(a.solves, b.solves);
  // A warning's name is the word before its first colon; the rest holds figures.
  const auto warning_name = [](const std::string& warning) { return warning.substr(0, warning.find(':')); };
  result.warnings = unshared(names_of(a.warnings, warning_name), names_of(b.warnings, warning_name));
  result.notes = unshared(names_of(a.notes, warning_name), names_of(b.notes, warning_name));
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
