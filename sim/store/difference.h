#pragma once

#include <limits>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "sim/acoustics/transducer_array.h"
#include "sim/mesh/triangle_mesh.h"
#include "sim/target/target.h"

/// How far apart two lists of values are that should be the same, and the models of two runs. A value that is the same
/// in both, bit for bit or NaN in both, counts as no difference; `relative` is 0 for the same, infinite for what cannot
/// be compared or does not correspond; `identical` is bit for bit.
namespace touchfield {

inline constexpr double kInfinite = std::numeric_limits<double>::infinity();

/// True for equal bits, and for two NaN.
bool same_value(double a, double b);

/// |a - b| / max(|a|, |b|); 0 for the same value, infinite if only one of them is finite.
double relative_change(double a, double b);

/// Difference of plain numbers.
struct NumbersDifference {
  bool identical = true;  // bit for bit; NaN equals NaN
  double relative = 0.0;  // largest |a - b| over the largest |a| or |b|
  std::string fault;      // why they cannot be compared; empty: they can
};

NumbersDifference compare_numbers(std::span<const double> a, std::span<const double> b);

/// The entries of a matrix, column by column.
template <class Values>
std::span<const double> numbers(const Values& values) {
  return {values.data(), static_cast<std::size_t>(values.size())};
}

/// Difference of complex amplitudes, as they are and after the one phase that brings b nearest to a.
///
///   turn = arg sum w conj(a) b,   relative = sqrt(sum w |b exp(-i turn) - a|^2 / max(sum w |a|^2, sum w |b|^2))
struct ComplexDifference {
  bool identical = true;
  double relative = 0.0;  // after the turn, 0 to sqrt(2)
  double as_is = 0.0;     // without it, 0 to 2
  double turn = 0.0;      // [rad], by which b is ahead of a
  std::string fault;
};

/// weights   one a value, >= 0, e.g. areas; empty: all alike
ComplexDifference compare_complex(const Eigen::VectorXcd& a, const Eigen::VectorXcd& b, const Eigen::VectorXd& weights);

/// Difference of the phases of drives, wrapped to -pi..pi, after the one phase that brings the drives of b nearest to
/// those of a.
struct PhasesDifference {
  bool identical = true;
  double largest = 0.0;  // [rad]
  double rms = 0.0;      // [rad]
  double turn = 0.0;     // [rad], by which b is ahead of a
  std::string fault;
};

/// phases       [rad], one a channel
/// amplitudes   one a channel; the phase of a channel that is silent in both does not count
PhasesDifference compare_phases(const Eigen::VectorXd& phases_a, const Eigen::VectorXd& amplitudes_a,
                                const Eigen::VectorXd& phases_b, const Eigen::VectorXd& amplitudes_b);

/// A text that two runs do not share; none where a run lacks it.
struct TextChange {
  std::string what;
  std::optional<std::string> a;
  std::optional<std::string> b;
};

/// Adds a change if the two texts differ.
void add_change(std::vector<TextChange>& changes, const std::string& what, const std::string& a, const std::string& b);

/// The motion that brings a's vertices nearest to b's, in the least squares' sense.
struct MeshMotion {
  Vector3 shift;        // of the vertices' mean [m]
  double angle = 0.0;   // of the rotation about it [rad], 0 to pi
  double residual = 0;  // largest distance that is left [m]
};

struct MeshDifference {
  bool identical = true;
  std::pair<Eigen::Index, Eigen::Index> faces;
  std::pair<Eigen::Index, Eigen::Index> vertices;
  bool same_triangles = true;
  std::optional<double> distance;  // largest of a vertex [m]; none: other numbers of vertices
  double relative = 0.0;           // that over the larger diagonal; infinite where the triangles differ
  std::optional<MeshMotion> motion;
};

MeshDifference compare_meshes(const TriangleMesh& a, const TriangleMesh& b);

struct ArrayDifference {
  bool identical = true;
  std::pair<Eigen::Index, Eigen::Index> channels;
  std::vector<TextChange> texts;   // kind, directivity
  bool same_numbering = true;      // devices and channels
  std::optional<double> distance;  // largest of a channel [m]; none: other numbers of channels
  std::optional<double> tilt;      // largest angle between axes [rad]
  NumbersDifference amplitudes;
  NumbersDifference responses;       // of what the solver reckons with
  NumbersDifference true_responses;  // of what sounds
  double relative = 0.0;             // the largest of all; a distance over the larger extent of the arrays
};

/// All but the true responses.
ArrayDifference compare_arrays(const TransducerArray& a, const TransducerArray& b);

/// Real and imaginary parts of gain exp(i phase); 1 where channels are as designed.
NumbersDifference compare_responses(const ChannelResponse& a, Eigen::Index channels_a, const ChannelResponse& b,
                                    Eigen::Index channels_b);

struct TargetDifference {
  bool identical = true;
  std::pair<Eigen::Index, Eigen::Index> faces;       // 0: no target
  std::pair<Eigen::Index, Eigen::Index> only_faces;  // of one of them
  NumbersDifference amplitudes;                      // where the faces are the same
  double relative = 0.0;
};

TargetDifference compare_targets(const std::optional<Target>& a, const std::optional<Target>& b);

}  // namespace touchfield
