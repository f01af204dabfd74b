#pragma once

#include <limits>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "sim/store/run_data.h"
#include "sim/store/value_tree.h"

/// Differences between two lists of values that should be the same, and between the models of two runs, as groups of
/// values. A value that is the same in both, bit for bit or NaN in both, counts as no difference. In every group
/// `identical` is bit for bit. `relative` is 0 for the same values. It is infinite for those that cannot be compared or
/// do not correspond; `fault` then says why.
namespace touchfield {

inline constexpr double kInfinite = std::numeric_limits<double>::infinity();

/// True for equal bits, and for two NaN.
bool same_value(double a, double b);

/// |a - b| / max(|a|, |b|); 0 for the same value, infinite if only one of them is finite.
double relative_change(double a, double b);

/// Plain numbers: identical, relative (the largest |a - b| over the largest |a| or |b|), fault.
Value compare_numbers(std::span<const double> a, std::span<const double> b);

/// The entries of a matrix, column by column.
template <class Values>
std::span<const double> numbers(const Values& values) {
  return {values.data(), static_cast<std::size_t>(values.size())};
}

/// Complex amplitudes, as they are and after the one phase that brings b nearest to a:
///
///   identical, fault
///   relative   after that phase, 0 to sqrt(2)
///   as_it_is   the same without the phase, 0 to 2
///   turn_rad   the phase, by which b is ahead of a
///
///   turn = arg sum w conj(a) b,   relative = sqrt(sum w |b exp(-i turn) - a|^2 / max(sum w |a|^2, sum w |b|^2))
///
/// weights   one per value, >= 0, e.g. areas; empty: all alike
Value compare_complex(const Eigen::VectorXcd& a, const Eigen::VectorXcd& b, const Eigen::VectorXd& weights);

/// Phases of drives, wrapped to -pi..pi, after the one phase that brings the drives of b nearest to those of a:
///
///   identical, fault
///   largest_rad, rms_rad
///   turn_rad               that phase, by which b is ahead of a
///
/// phases       [rad], one per channel
/// amplitudes   one per channel; the phase of a channel that is silent in both does not count
Value compare_phases(const Eigen::VectorXd& phases_a, const Eigen::VectorXd& amplitudes_a,
                     const Eigen::VectorXd& phases_b, const Eigen::VectorXd& amplitudes_b);

/// A text that two runs do not share; none where a run lacks it.
struct TextChange {
  std::string what;
  std::optional<std::string> a;
  std::optional<std::string> b;
};

/// Each text by what it says.
Value changes_of(const std::vector<TextChange>& changes);

/// Adds a change if the two texts differ.
void add_change(Value& changes, const std::string& what, const std::string& a, const std::string& b);

/// Differences between two meshes:
///
///   identical, faces, vertices, same_triangles
///   largest_distance_m   of a vertex; null: other numbers of them
///   relative             that over the larger diagonal; infinite where the triangles differ
///   motion               what brings a's vertices nearest to b's in the least squares' sense; only for the same
///                        triangles, and not where the meshes are identical
///     shift_m            of the vertices' mean
///     angle_rad          of the rotation about it, 0 to pi
///     residual_m         the largest distance that is left
Value compare_meshes(const TriangleMesh& a, const TriangleMesh& b);

/// Differences between two arrays:
///
///   identical, channels
///   changes              kind, directivity, phase_levels
///   same_numbering       of devices and channels
///   largest_distance_m   of a channel; null: other numbers of channels
///   largest_tilt_rad     between axes; null: likewise
///   amplitudes
///   responses            that the solver assumes: real and imaginary parts of gain exp(i phase), 1 where channels are
///                        as designed
///   true_responses       likewise, of what the arrays really do
///   relative             the largest of all; a distance over the larger extent of the arrays
///
/// truth   what the arrays really do, where that is something else
Value compare_arrays(const TransducerArray& a, const TransducerArray& b, const std::optional<ArrayTruth>& truth_a = {},
                     const std::optional<ArrayTruth>& truth_b = {});

/// identical, faces (0: no target), faces_in_one_alone, amplitudes (where the faces are the same), relative.
Value compare_targets(const std::optional<Target>& a, const std::optional<Target>& b);

}  // namespace touchfield
