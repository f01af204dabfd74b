#pragma once

#include <array>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "sim/core/json.h"
#include "sim/run/run_data.h"

namespace touchfield {

/// How far apart values of two runs a and b are that should be the same. NaN is the same as NaN.
struct Difference {
  bool identical = true;  // bit for bit
  double relative = 0;    // 0: the same values; infinite: they cannot be compared
  std::string fault{};    // why they cannot
  double as_it_is = 0;    // of complex values: without the phase
  double turn = 0;        // [rad]: the phase by which b is ahead of a
};

/// |a - b| / max(|a|, |b|); 0 for the same value, infinite if only one of them is finite.
double relative_change(double a, double b);

/// The largest |a - b| over the largest |a| or |b|.
Difference compare_numbers(std::span<const double> a, std::span<const double> b);

/// Complex amplitudes, after the one phase that brings b nearest to a, 0 to sqrt(2):
///
///   turn = arg sum w conj(a) b,   relative = sqrt(sum w |b exp(-i turn) - a|^2 / max(sum w |a|^2, sum w |b|^2))
///
/// weights   one per value, >= 0, e.g. areas; empty: all alike
Difference compare_complex(const Eigen::VectorXcd& a, const Eigen::VectorXcd& b, const Eigen::VectorXd& weights = {});

/// Phases of drives: the largest difference of a channel [rad], wrapped, after the one phase that brings the drives of
/// b nearest to those of a.
///
/// phases       [rad], one per channel
/// amplitudes   one per channel; the phase of a channel that is silent in both does not count
Difference compare_phases(const Eigen::VectorXd& phases_a, const Eigen::VectorXd& amplitudes_a,
                          const Eigen::VectorXd& phases_b, const Eigen::VectorXd& amplitudes_b);

/// A key of two scenes that do not say the same; nothing where one lacks it.
struct SceneKeyChange {
  std::string path;
  std::optional<std::string> a;
  std::optional<std::string> b;
};

/// What differs most, and by how much.
struct Deviation {
  std::string what{};  // empty: nothing
  double relative = 0;
};

/// A method that both runs have.
struct MethodDifference {
  std::string name{};
  bool identical = true;
  Difference phases{};
  Difference amplitudes{};
  Difference pressure{};
  std::optional<Difference> evaluation_pressure{};  // if one of the runs has it
  Metrics a{};
  Metrics b{};
};

/// A field that both runs have.
struct FieldDifference {
  std::string name{};
  bool identical = true;
  std::string fault{};                                         // of its points
  std::vector<std::pair<std::string, Difference>> pressure{};  // by method
};

/// The differences between two runs a and b. Times never count. What only one run has counts as infinitely different.
///
/// Two runs are the same to rounding if no number differs by more than 1e-6 relative. The limit is 1e-4 if either run
/// solved a system in single precision. Iterated phases amplify the last bits of a sum. Measured on
/// scenes/capsule.yaml, one thread against two: 3e-9, and 4e-5 in single precision.
struct RunDifference {
  bool identical = true;  // models and results, bit for bit
  double rounding = 0;
  Deviation largest{};         // of models and results
  Deviation largest_result{};  // of phases, amplitudes, pressures, metrics, fields
  std::array<Provenance, 2> provenance{};
  std::vector<SceneKeyChange> scene{};
  std::vector<std::pair<std::string, Difference>> models{};  // mesh, array, target, evaluation
  std::array<std::vector<std::string>, 2> methods_in_one_alone{};
  std::array<std::vector<std::string>, 2> fields_in_one_alone{};
  std::vector<MethodDifference> methods{};
  std::vector<FieldDifference> fields{};

  /// identical, same_to_rounding or different.
  std::string verdict() const;
};

/// scene   how the scenes differ: scene_changes
RunDifference compare_runs(const Run& a, const Run& b, const std::vector<SceneKeyChange>& scene);

/// As `touchfield compare --json` has it.
Json difference_value(const RunDifference& difference);

/// As text for a person: both provenances, models, methods, metrics with the sign of their change, fields, the verdict.
std::string describe_difference(const RunDifference& difference);

}  // namespace touchfield
