#pragma once

#include <limits>
#include <vector>

#include "solvers/phase/phase_solution.h"
#include "solvers/phase/skin_problem.h"

namespace touchfield {

/// Patterns in turn on one body that does not move. Of all U faces that any of them uses, frame k wants p'_kj on face
/// j, 0 for silence there:
///
///   cost_k(q) = sum_j w_kj (|h_j q| - p'_kj)^2 + |R q|^2
///
/// R is the skin that none of them uses. So the matrices are the same for all frames.
struct PhaseSequence {
  Eigen::MatrixXcd rows;       // h, U x N [Pa]
  Eigen::MatrixXcd outside;    // R, r x N [Pa m]
  Eigen::MatrixXd amplitudes;  // p', U x F [Pa], >= 0
  Eigen::MatrixXd weights;     // w, U x F, > 0
  /// The face in the middle of each frame's pattern, F: as its pressure turns from frame to frame, so do the phases
  /// that a frame starts from.
  std::vector<Eigen::Index> middle;

  Eigen::Index frame_count() const { return amplitudes.cols(); }
};

/// The problem of one frame by itself, as method surface takes it: faces that are to be silent are rows of R.
SkinProblem problem_of(const PhaseSequence& sequence, Eigen::Index frame);

struct SequenceOptions {
  int first_iterations = 100;  // of method surface on the first frame, which also searches its starts
  int iterations = 24;         // of each later frame, from the phases of the one before it
  bool free_level = true;      // each frame has one amplitude of all channels, up to 1
  double most_turn = std::numeric_limits<double>::infinity();  // [rad] of any channel's phase between frames, > 0
  bool closed = false;  // the first frame follows the last one: their phases keep the limit too
};

/// Drives of every frame. The first is method surface's own. Each later one descends (PhaseDescent) from the one before
/// it. With `most_turn` no phase changes by more than that from frame to frame, to rounding. Frame k of F of a closed
/// sequence then also stays within (F - k) most_turn of the first.
///
/// callback   told after every frame
/// throws     std::invalid_argument on sizes that do not fit, no frame, or options out of range
std::vector<PhaseSolution> solve_sequence(const PhaseSequence& sequence, const SequenceOptions& options,
                                          const IterationCallback& callback = {});

}  // namespace touchfield
