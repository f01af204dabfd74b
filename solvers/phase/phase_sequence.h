#pragma once

#include <limits>
#include <vector>

#include <Eigen/Core>

#include "solvers/phase/phase_solution.h"
#include "solvers/phase/radiation.h"
#include "solvers/phase/skin_problem.h"

namespace touchfield {

/// Patterns in turn on one body that does not move. Of all U faces that any of them uses, frame k wants p'_kj on face
/// j, 0 for silence there:
///
///   cost_k(q) = sum_j w_kj (|h_j q| - p'_kj)^2 + |R q|^2,   a constant left out where faces count as one (MappedSkin)
///
/// R is the skin that none of them uses. So the matrices are the same for all frames. Where `radiation` is not empty it
/// has the cost of each frame instead (radiation_cost), of the pressures of the rows and then of R.
struct PhaseSequence {
  Eigen::MatrixXcd rows;       // h, U x N [Pa]
  Eigen::MatrixXcd outside;    // R, r x N [Pa m]
  Eigen::MatrixXd amplitudes;  // p', U x F [Pa], >= 0
  Eigen::MatrixXd weights;     // w, U x F, > 0
  /// The face in the middle of each frame's pattern, F: as its pressure turns from frame to frame, so do the phases
  /// that a frame starts from.
  std::vector<Eigen::Index> middle;

  std::vector<RadiationSkin> radiation{};  // F, or none

  Eigen::Index frame_count() const { return amplitudes.cols(); }
};

/// The problem of one frame by itself, as method surface takes it: faces that are to be silent are rows of R.
SkinProblem problem_of(const PhaseSequence& sequence, Eigen::Index frame);

/// One frame by itself, with a search of its starts: by method radiation where the sequence has it, else by surface.
///
/// iterations   of surface; radiation takes its usual ones
PhaseSolution solve_alone(const PhaseSequence& sequence, Eigen::Index frame, int iterations, bool free_level);

struct SequenceOptions {
  int first_iterations = 100;  // of method surface on the first frame
  int iterations = 24;         // of each later frame, from the phases of the one before it; at least first_iterations
                               // where less than half of what is wanted was wanted there before
  bool free_level = true;      // each frame has one amplitude of all channels, up to 1
  double most_turn = std::numeric_limits<double>::infinity();  // [rad] of any channel's phase between frames, > 0
  bool closed = false;  // the first frame follows the last one: their phases keep the limit too
};

/// Drives of every frame. The first is solved by itself (solve_alone). Each later one descends (PhaseDescent) from the
/// one before it. With `most_turn` no phase changes by more than that from frame to frame, to rounding. Frame k of F of
/// a closed sequence then also stays within (F - k) most_turn of the first.
///
/// callback   told after every frame
/// throws     std::invalid_argument on sizes that do not fit, no frame, or options out of range
std::vector<PhaseSolution> solve_sequence(const PhaseSequence& sequence, const SequenceOptions& options,
                                          const IterationCallback& callback = {});

}  // namespace touchfield
