#include "sim/store/run_verdict.h"

#include <algorithm>
#include <limits>
#include <string_view>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace touchfield {

namespace {

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
  tally.result(fmt::format("field {}: what is inside", field.name), field.identical, inside);
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
  add(scene_cause(difference.scene));
  add(recorded_cause(difference.provenance, "the program", {"version", "revision"}));
  add(recorded_cause(difference.provenance, "the build", {"compiler", "flags"}));
  add(file_cause(difference, a.scene));
  for (const TextChange& change : difference.solvers) {
    add(fmt::format("the solver of {}: {} -> {}", change.what, *change.a, *change.b));
  }
  add(recorded_cause(difference.provenance, "threads", {"threads"}));
  add(recorded_cause(difference.provenance, "the machine", {"machine", "blas_core", "instruction_level"}));
  if (a.provenance.revision == b.provenance.revision && a.provenance.revision.ends_with("-dirty")) {
    add(fmt::format("the program: {} may be two programs, its sources were not committed", a.provenance.revision));
  }
  if (causes.empty() && difference.verdict == Verdict::kDifferent) {
    add("nothing that is recorded; two runs of one program and one scene should not differ so");
  }
  return causes;
}

}  // namespace

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

}  // namespace touchfield
