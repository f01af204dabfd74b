#pragma once

#include <deque>
#include <functional>
#include <limits>
#include <vector>

#include "solvers/phase/phase_solution.h"
#include "solvers/phase/skin_problem.h"

namespace touchfield {

/// The misfit of amplitudes on all faces, p = H q, known by products with H alone:
///
///   cost(q) = sum_j w_j (|p_j| - p'_j)^2
///
/// It is skin_cost with the faces outside among the M faces, p'_j = 0 and w_j = w_Z A_j there.
struct MappedSkin {
  std::function<Eigen::VectorXcf(const Eigen::VectorXcf& q)> pressure;   // H q, M
  std::function<Eigen::VectorXcf(const Eigen::VectorXcf& v)> sent_back;  // H^H v, N
  Eigen::VectorXd amplitudes;                                            // p', M [Pa], >= 0
  Eigen::VectorXd weights;                                               // w, M, >= 0
};

/// Bounds of phases [rad], N each; empty: there are none.
struct PhaseBounds {
  Eigen::VectorXd low;
  Eigen::VectorXd high;
};

/// Follows the phases of least cost through a sequence of problems that change little from one to the next, as those of
/// a body that moves. This is limited-memory BFGS with a memory of curvature that continues from problem to problem.
/// Each step halves until the cost falls (Armijo). It turns phases by at most 0.3 rad, root mean square.
///
/// source   Nocedal, Math. Comp. 35 (1980) 773
class PhaseDescent {
 public:
  /// Steps from these phases at full drive, N. One step takes a product with H for each trial, 1.1 on average, and one
  /// with H^H.
  ///
  /// start        within the bounds
  /// free_level   whether all drives have, in the end, the amplitude up to 1 at which the cost is least
  /// throws       std::domain_error if the cost at the start is not finite
  PhaseSolution descend(const MappedSkin& skin, const Eigen::VectorXd& start, int iterations, bool free_level,
                        const PhaseBounds& bounds = {});

 private:
  static Eigen::VectorXd within(const PhaseBounds& bounds, const Eigen::VectorXd& phases);
  Eigen::VectorXd direction(const Eigen::VectorXd& gradient) const;
  void remember(Eigen::VectorXd step, Eigen::VectorXd change);

  struct Pair {
    Eigen::VectorXd step;
    Eigen::VectorXd change;  // of the gradient
    double product;          // of both, > 0
  };
  std::deque<Pair> memory_;
};

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
