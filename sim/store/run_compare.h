#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "sim/store/difference.h"
#include "sim/store/run_data.h"

namespace touchfield {

/// A number of each run; `relative` is relative_change of the two.
struct NumberPair {
  std::string name;
  double a = kNotComputed;
  double b = kNotComputed;
  double relative = 0.0;
};

struct JudgeDifference {
  std::vector<TextChange> texts;       // judge, scheme
  std::optional<MeshDifference> mesh;  // where both have one of their own
  std::optional<TargetDifference> target;
};

/// How far apart the results of one method are.
struct MethodDifference {
  std::string name;
  bool identical = true;          // bit for bit, times aside
  std::vector<TextChange> texts;  // method, scheme, status
  PhasesDifference phases;
  NumbersDifference amplitudes;
  ComplexDifference pressure;  // weighted by area
  std::optional<ComplexDifference> judge_pressure;
  std::pair<std::size_t, std::size_t> cost_length;
  NumbersDifference cost;
  std::vector<NumberPair> metrics;  // every one but times
  std::vector<NumberPair> seconds;  // shown, never counted
};

struct FieldDifference {
  std::string name;
  bool identical = true;
  std::string fault;       // why the grids cannot be compared; empty: they are the same
  std::size_t inside = 0;  // points that are inside a body in one run only
  std::size_t points = 0;
  std::vector<std::pair<std::string, ComplexDifference>> pressure;  // method -> difference
};

/// What only one of the runs has.
struct OnlyIn {
  std::vector<std::string> a;
  std::vector<std::string> b;

  bool empty() const { return a.empty() && b.empty(); }
};

/// How two scenes differ.
struct SceneDifference {
  std::vector<TextChange> changes;  // by key path
  OnlyIn at_defaults;               // keys that one of them lacks, and the other has at what it means without them
};

/// How far apart something is, and what it is.
struct Deviation {
  std::string what;  // empty: nothing differs
  double relative = 0.0;
};

enum class Verdict {
  kIdentical,  // models and results are the same, bit for bit
  kRounding,   // no number of them differs by more than RunDifference::rounding
  kDifferent,
};

/// identical, same_to_rounding, different
std::string to_string(Verdict verdict);

/// How two runs differ: what was recorded about them, what they modelled, what they found, and what it comes to.
struct RunDifference {
  std::pair<bool, bool> complete;
  std::pair<SkinExtent, SkinExtent> judged_skin;  // where they differ, no metric can be compared
  std::vector<TextChange> provenance;             // named as in /provenance; start and end aside
  SceneDifference scene;
  MeshDifference mesh;
  ArrayDifference array;
  TargetDifference target;
  JudgeDifference judge;
  std::vector<TextChange> solvers;  // how a stage's system was solved
  OnlyIn warnings;                  // by name
  OnlyIn notes;                     // likewise
  OnlyIn methods;
  std::vector<MethodDifference> both_methods;  // those of both runs
  OnlyIn fields;
  std::vector<FieldDifference> both_fields;

  Verdict verdict = Verdict::kIdentical;
  double rounding = 0.0;            // what counts as rounding, relative
  Deviation largest;                // of models and results
  Deviation largest_result;         // of results: phases, amplitudes, pressures, metrics, fields
  std::vector<std::string> causes;  // what may have made the difference, the most likely first; none if identical
};

/// Compares two runs. Pressures and fields differ by their relative L2 distance after the best common phase, phases by
/// the largest of a channel in radians after theirs, all else relative to the larger of the two numbers. NaN equals
/// NaN. Times never count. What only one run has, or has in another size, counts as infinitely different.
///
/// Rounding is 1e-6 relative, or 1e-4 if a system of either run was solved in single precision: iterated phases grow
/// the last bits of a sum (measured on scenes/quick.yaml, one thread against two: 3e-9, and 4e-5 in single precision).
///
/// scene   how the scenes differ: scene_changes
RunDifference compare_runs(const Run& a, const Run& b, SceneDifference scene);

/// A difference as text for a person, line by line, the verdict and its causes last.
std::string describe_difference(const RunDifference& difference);

}  // namespace touchfield
