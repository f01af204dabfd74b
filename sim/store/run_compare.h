#pragma once

#include <string>
#include <vector>

#include "sim/store/difference.h"

namespace touchfield {

/// What only one of the runs has.
struct OnlyIn {
  std::vector<std::string> a;
  std::vector<std::string> b;
};

/// How two scenes differ.
struct SceneDifference {
  std::vector<TextChange> changes;  // by key path
  OnlyIn at_defaults;               // keys that one of them lacks, and the other has at what it means without them
};

/// The differences between two runs, as `compare --json` prints them: of records, models and results, with a verdict.
/// Its parts are described in difference.h; `a` and `b` are the two runs' values.
///
///   verdict          identical (models and results, bit for bit), same_to_rounding (no number differs by more than
///                    `rounding`) or different
///   largest          of models and results: `relative`, and `what` differs so; empty if nothing does
///   largest_result   the same of results: phases, amplitudes, pressures, metrics, fields
///   causes           what may have made the difference, the most likely first; none if identical
///   judged_skin      where they differ, no metric can be compared
///   provenance, scene, solvers   texts that differ
///   mesh, array, target, judge   the models
///   ..._in_one_alone   names
///   methods, fields   of both runs
///
/// Pressures and fields differ by their relative L2 distance after the best common phase. Phases differ by the largest
/// difference of a channel in radians, after the best common phase of theirs. Other numbers differ relative to the
/// larger of the two. NaN equals NaN. Times never count. What only one run has, or has in another size, counts as
/// infinitely different.
///
/// Rounding is 1e-6 relative, or 1e-4 if a system of either run was solved in single precision. Iterated phases amplify
/// the last bits of a sum. Measured on scenes/quick.yaml, one thread against two: 3e-9, and 4e-5 in single precision.
///
/// scene   how the scenes differ: scene_changes
Value compare_runs(const Run& a, const Run& b, const SceneDifference& scene);

/// A difference as text for a person, line by line, the verdict and its causes last.
std::string describe_difference(const Value& difference);

}  // namespace touchfield
