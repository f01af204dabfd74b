#pragma once

#include <deque>
#include <functional>

#include "solvers/phase/phase_solution.h"

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

}  // namespace touchfield
