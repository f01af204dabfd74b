#include "sim/store/run_compare.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <set>
#include <string_view>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "sim/store/run_layout.h"

namespace touchfield {

namespace {

constexpr double kRounding = 1e-6;
constexpr double kSingleRounding = 1e-4;

/// How far apart something is, and what it is.
struct Deviation {
  std::string what;  // empty: nothing differs
  double relative = 0.0;

  Value value() const { return {{"relative", relative}, {"what", what}}; }
};

/// What has been looked at so far.
class Tally {
 public:
  bool identical = true;
  Deviation largest;
  Deviation largest_result;

  void add(const std::string& what, double relative, bool is_result) {
    for (Deviation* most : {&largest, is_result ? &largest_result : nullptr}) {
      if (most != nullptr && relative > most->relative) {
        *most = {what, relative};
      }
    }
  }
  /// A group of difference.h.
  Value model(const std::string& what, Value difference) {
    identical = identical && difference["identical"].flag();
    add(what, difference["relative"].number(), false);
    return difference;
  }
  Value result(const std::string& what, Value difference, std::string_view measure = "relative") {
    identical = identical && difference["identical"].flag();
    add(what, difference[measure].number(), true);
    return difference;
  }
  /// What a part of the runs comes to.
  void take(const Tally& part) {
    identical = identical && part.identical;
    add(part.largest.what, part.largest.relative, false);
    add(part.largest_result.what, part.largest_result.relative, true);
  }
  /// Texts that make two models incomparable where they differ.
  Value texts(const std::string& what, Value changes) {
    identical = identical && changes.empty();
    add(what, changes.empty() ? 0.0 : kInfinite, false);
    return changes;
  }
};

template <class List, class Name>
Value unshared(const List& in_a, const List& in_b, const Name& name) {
  const auto names_of = [&](const List& list) {
    std::set<std::string> names;
    std::ranges::transform(list, std::inserter(names, names.end()), name);
    return names;
  };
  const std::set<std::string> a = names_of(in_a);
  const std::set<std::string> b = names_of(in_b);
  std::pair<std::vector<std::string>, std::vector<std::string>> only;
  std::ranges::set_difference(a, b, std::back_inserter(only.first));
  std::ranges::set_difference(b, a, std::back_inserter(only.second));
  return only;
}

/// The same of results, where it counts.
template <class List, class Name>
Value unshared_results(Tally& tally, const char* noun, const List& in_a, const List& in_b, const Name& name) {
  const Value only = unshared(in_a, in_b, name);
  for (const auto& [run, side] : {std::pair{'A', "a"}, std::pair{'B', "b"}}) {
    for (const Value& one : only[side].list()) {
      tally.identical = false;
      tally.add(fmt::format("{} {} is in {} alone", noun, one.text(), run), kInfinite, true);
    }
  }
  return only;
}

Value compare_provenance(const Provenance& a, const Provenance& b) {
  Value changes = Value::Group();
  for (const ProvenanceField& field : provenance_fields()) {
    const std::string_view name = field.name;
    if (name != "start" && name != "end") {
      add_change(changes, field.name, a.*field.value, b.*field.value);
    }
  }
  add_change(changes, "threads", fmt::to_string(a.threads), fmt::to_string(b.threads));
  return changes;
}

Value compare_judges(Tally& tally, const Run& a, const Run& b) {
  const bool comparable = a.judge_model && b.judge_model;
  Value changes = Value::Group();
  add_change(changes, "judge", a.judge, b.judge);
  if (comparable) {
    add_change(changes, "scheme", a.judge_model->scheme, b.judge_model->scheme);
  }
  return {
      {"changes", tally.texts("the judge", changes)},
      {"mesh", comparable ? tally.model("the judge's mesh", compare_meshes(a.judge_model->mesh, b.judge_model->mesh))
                          : Value()},
      {"target", comparable
                     ? tally.model("the judge's target", compare_targets(a.judge_model->target, b.judge_model->target))
                     : Value()}};
}

/// How a stage's system was solved, where that differs.
Value compare_solvers(const std::vector<SolveRecord>& a, const std::vector<SolveRecord>& b) {
  const auto how = [](const SolveRecord& solve) { return fmt::format("{}, {}", solve.solver, solve.precision); };
  Value changes = Value::Group();
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

Value compare_pressures(const MethodOf& a, const MethodOf& b) {
  return compare_complex(a.method.pressure, b.method.pressure, weights_of(a.run.mesh, a.method.pressure));
}

/// Null where neither run has the judge's pressure.
Value compare_judged(const MethodOf& a, const MethodOf& b) {
  if (a.method.judge_pressure.size() == 0 && b.method.judge_pressure.size() == 0) {
    return {};
  }
  const Eigen::VectorXcd& judged = judged_pressure(a.method, a.run);
  const TriangleMesh& mesh = a.run.judge_model ? a.run.judge_model->mesh : a.run.mesh;
  return compare_complex(judged, judged_pressure(b.method, b.run), weights_of(mesh, judged));
}

/// A metric of both runs; `relative` is relative_change of the two.
Value compare_metrics(Tally& tally, const MethodOf& of_a, const MethodOf& of_b, bool times) {
  Value metrics = Value::Group();
  for (const MetricField& field : metric_fields()) {
    if ((std::string_view(field.unit) == "s") == times) {
      const double a = of_a.method.metrics.*field.value;
      const double b = of_b.method.metrics.*field.value;
      Value pair = std::pair(field.share ? Value::share(a) : Value(a), field.share ? Value::share(b) : Value(b));
      if (!times) {
        pair.add("relative", relative_change(a, b));
        tally.identical = tally.identical && same_value(a, b);
        tally.add(fmt::format("{} of {}", field.name, of_a.method.name), relative_change(a, b), true);
      }
      metrics.add(field.name, pair);
    }
  }
  return metrics;
}

Value compare_methods(Tally& tally, const MethodOf& of_a, const MethodOf& of_b) {
  const PhaseSolution& a = of_a.method.solution;
  const PhaseSolution& b = of_b.method.solution;
  const std::string of = " of " + of_a.method.name;
  Tally own;
  Value changes = Value::Group();
  add_change(changes, "method", of_a.method.method, of_b.method.method);
  add_change(changes, "scheme", of_a.method.scheme, of_b.method.scheme);
  add_change(changes, "status", to_string(a.status), to_string(b.status));
  Value cost = compare_numbers(a.cost_history, b.cost_history);
  cost.add("length", std::pair(a.cost_history.size(), b.cost_history.size()));
  own.identical = changes.empty() && cost["identical"].flag() && a.iterations == b.iterations;
  const Value judged = compare_judged(of_a, of_b);
  const Value parts = {
      {"changes", changes},
      {"phases",
       own.result("phases" + of, compare_phases(a.phases, a.amplitudes, b.phases, b.amplitudes), "largest_rad")},
      {"amplitudes", own.result("amplitudes" + of, compare_numbers(numbers(a.amplitudes), numbers(b.amplitudes)))},
      {"pressure", own.result("pressure" + of, compare_pressures(of_a, of_b))},
      {"judge_pressure", judged.empty() ? judged : own.result("judge's pressure" + of, judged)},
      {"cost", cost},
      {"metrics", compare_metrics(own, of_a, of_b, false)},
      {"seconds", compare_metrics(own, of_a, of_b, true)}};
  tally.take(own);
  Value result = {{"name", of_a.method.name}, {"identical", own.identical}};
  result.add(parts);
  return result;
}

std::string grid_fault(const FieldGrid& a, const FieldGrid& b) {
  if (a.count != b.count) {
    return fmt::format("{} and {} points", fmt::join(a.count, " x "), fmt::join(b.count, " x "));
  }
  return a.origin == b.origin && a.spacing == b.spacing ? "" : "its points are at other places";
}

Value compare_fields(Tally& tally, const FieldResult& a, const FieldResult& b) {
  const std::string fault = grid_fault(a.grid, b.grid);
  Tally own;
  std::size_t inside = 0;  // points that are inside a body in one run only
  Value pressures = Value::Group();
  own.identical = fault.empty();
  if (!fault.empty()) {
    own.add(fmt::format("field {}: its grid", a.grid.name), kInfinite, true);
  } else {
    for (std::size_t i = 0; i < a.inside.size(); ++i) {
      inside += a.inside[i] != b.inside[i] ? 1U : 0U;
    }
    own.identical = inside == 0;
    own.add(fmt::format("field {}: the points inside bodies", a.grid.name),
            static_cast<double>(inside) / static_cast<double>(std::max<std::size_t>(a.inside.size(), 1)), true);
    for (const auto& [method, pressure] : a.pressure) {
      const auto other = std::ranges::find(b.pressure, method, [](const auto& entry) { return entry.first; });
      if (other != b.pressure.end()) {
        pressures.add(method, own.result(fmt::format("field {} of {}", a.grid.name, method),
                                         compare_complex(pressure, other->second, {})));
      }
    }
  }
  tally.take(own);
  return {{"name", a.grid.name},
          {"identical", own.identical},
          {"fault", fault},
          {"inside_in_one_alone", inside},
          {"pressure", pressures}};
}

/// What compare makes of every element of both lists that have a name in common.
template <class List, class Name, class Compare>
Value in_both(const List& in_a, const List& in_b, const Name& name, const Compare& compare) {
  Value::List results;
  for (const auto& one : in_a) {
    const auto other = std::ranges::find(in_b, name(one), name);
    if (other != in_b.end()) {
      results.push_back(compare(one, *other));
    }
  }
  return results;
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
  const std::size_t more = keys.size() > kNamed ? keys.size() - kNamed : 0;
  keys.resize(keys.size() - more);
  return keys.empty() ? ""
                      : fmt::format("the scene: {}{}", fmt::join(keys, ", "),
                                    more == 0 ? "" : fmt::format(" and {} more", more));
}

/// The changes among those of these names, as one cause; empty if there is none.
std::string recorded_cause(const Value& changes, const char* noun, std::initializer_list<std::string_view> names) {
  std::vector<std::string> found;
  for (const std::string_view name : names) {
    if (!changes[name].empty()) {
      found.push_back(value_text(changes[name]));
    }
  }
  return found.empty() ? "" : fmt::format("{}: {}", noun, fmt::join(found, ", "));
}

/// What a scene reads from files, whose contents no run records, where it may have made the difference.
std::string file_cause(const Value& difference, const std::string& scene) {
  const auto names = [&](const char* key) { return scene.find(key) != std::string::npos; };
  if (!(difference["mesh"]["identical"].flag() && difference["array"]["identical"].flag()) && names(" file: ")) {
    return "a mesh or a table of positions that the scene names";
  }
  return names(" phases_file: ") || names(" previous: ") ? "the phases that the scene reads from a file" : "";
}

/// difference   all but what it comes to
std::vector<std::string> likely_causes(const Value& difference, const std::vector<TextChange>& scene, const Run& a,
                                       const Run& b) {
  const Value& provenance = difference["provenance"];
  std::vector<std::string> causes;
  if (a.complete != b.complete) {
    causes.push_back(fmt::format("{} is not complete", a.complete ? "B" : "A"));
  }
  causes.push_back(scene_cause(scene));
  causes.push_back(recorded_cause(provenance, "the program", {"version", "revision"}));
  causes.push_back(recorded_cause(provenance, "the build", {"compiler", "flags"}));
  causes.push_back(file_cause(difference, a.scene));
  for (const auto& [stage, change] : difference["solvers"].group()) {
    causes.push_back(fmt::format("the solver of {}: {}", stage, value_text(change)));
  }
  causes.push_back(recorded_cause(provenance, "threads", {"threads"}));
  causes.push_back(recorded_cause(provenance, "the machine", {"machine", "blas_core", "instruction_level", "card"}));
  if (a.provenance.revision == b.provenance.revision && a.provenance.revision.ends_with("-dirty")) {
    causes.push_back(fmt::format("the program: {} may be two programs, because its sources were not committed",
                                 a.provenance.revision));
  }
  std::erase(causes, "");
  return causes;
}

}  // namespace

Value compare_runs(const Run& a, const Run& b, const SceneDifference& scene) {
  Tally tally;
  // A warning's name is the word before its first colon; the rest holds figures.
  const auto remark_name = [](const std::string& remark) { return remark.substr(0, remark.find(':')); };
  const auto method_name = [](const MethodResult& method) { return method.name; };
  const auto field_name = [](const FieldResult& field) { return field.grid.name; };
  const bool same_skin = a.judged_skin == b.judged_skin;
  tally.identical = same_skin;
  tally.add("the skin that is evaluated", same_skin ? 0.0 : kInfinite, false);
  const Value parts = {
      {"judged_skin", std::pair(to_string(a.judged_skin), to_string(b.judged_skin))},
      {"provenance", compare_provenance(a.provenance, b.provenance)},
      {"scene", changes_of(scene.changes)},
      {"scene_defaults_in_one_alone", std::pair(scene.at_defaults.a, scene.at_defaults.b)},
      {"mesh", tally.model("the mesh", compare_meshes(a.mesh, b.mesh))},
      {"array", tally.model("the array", compare_arrays(a.array, b.array, a.array_truth, b.array_truth))},
      {"target", tally.model("the target", compare_targets(a.target, b.target))},
      {"judge", compare_judges(tally, a, b)},
      {"solvers", compare_solvers(a.solves, b.solves)},
      {"warnings_in_one_alone", unshared(a.warnings, b.warnings, remark_name)},
      {"notes_in_one_alone", unshared(a.notes, b.notes, remark_name)},
      {"methods_in_one_alone", unshared_results(tally, "method", a.methods, b.methods, method_name)},
      {"fields_in_one_alone", unshared_results(tally, "field", a.fields, b.fields, field_name)},
      {"methods", in_both(a.methods, b.methods, method_name,
                          [&](const MethodResult& of_a, const MethodResult& of_b) {
                            return compare_methods(tally, {a, of_a}, {b, of_b});
                          })},
      {"fields", in_both(a.fields, b.fields, field_name, [&](const FieldResult& of_a, const FieldResult& of_b) {
         return compare_fields(tally, of_a, of_b);
       })}};
  const double rounding = solved_in_single(a) || solved_in_single(b) ? kSingleRounding : kRounding;
  const bool rounded = tally.largest.relative <= rounding;
  std::vector<std::string> causes;
  if (!tally.identical) {
    causes = likely_causes(parts, scene.changes, a, b);
    if (causes.empty() && !rounded) {
      causes.emplace_back(
          "nothing that is recorded; two runs of one program and one scene should not differ this much");
    }
  }
  Value difference = {{"verdict", tally.identical ? "identical"
                                  : rounded       ? "same_to_rounding"
                                                  : "different"},
                      {"rounding", rounding},
                      {"largest", tally.largest.value()},
                      {"largest_result", tally.largest_result.value()},
                      {"causes", causes}};
  difference.add(parts);
  return difference;
}

}  // namespace touchfield
