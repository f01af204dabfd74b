#pragma once

#include "solvers/phase/skin_problem.h"

namespace touchfield {

struct OptimalityBoundOptions {
  int width = 12;           // columns l of the low-rank relaxation, 2..64
  int max_iterations = 60;  // of the relaxation, >= 0
  double tolerance = 1e-4;  // share of the relaxation's cost that the bound may lack, > 0
  unsigned seed = 1;
};

/// throws   std::invalid_argument on an option out of range; `who` begins the message
void require_valid(const OptimalityBoundOptions& options, const char* who);

/// A proved lower bound of a cost over all drives |q_n| <= 1, those of full amplitude among them.
struct OptimalityBound {
  double bound = 0.0;      // >= 0, in the unit of the cost
  double relaxed = 0.0;    // cost of the relaxation where it stopped: no bound, but what the bound grows towards
  int iterations = 0;      // of the relaxation
  bool converged = false;  // the bound is as near to the relaxation as the tolerance asks
};

/// That of skin_cost. With z = exp(i [theta; phi]), b_j = sqrt(w_j) p'_j, H = diag(sqrt w) H_T the cost, least over
/// theta, is z^H Q z,
///
///   Q = [diag(b^2), -diag(b) H; -(diag(b) H)^H, H^H H + R^H R],
///
/// and for real d and e:  z^H Q z = sum e + sum d + z^H (Q - diag [e; d]) z. With e_j = b_j^2 - b_j g_j, g_j > 0, the
/// faces are eliminated,
///
///   S = H^H diag(1 - b_j / g_j) H + R^H R - diag d,   cost >= sum_j (b_j^2 - b_j g_j) + sum_n d_n + N min(0, lambda),
///
/// lambda the smallest eigenvalue of S and d <= 0, which lets drives lie within the circle too.
///
/// g and d come from minimising the cost over drives that are rows of l numbers, of length one at most (regularised
/// Newton steps). The start is the drives that solve_surface reaches with free amplitudes and its usual steps. As few
/// dimensions are used as the tolerance allows.
///
/// The Cholesky factorisation of the whole S + shift in double proves that -lambda is no more than the shift. Its
/// rounding is bounded a priori. The bound thus holds whatever produced g and d. Leaving rows out of R only lowers S,
/// so that the bound holds for the full cost too.
///
/// cost     per iteration: three to six factorisations and about 15 solves by DualFactor; the proof one Cholesky
///          factorisation N x N or more. Fastest with the rows of R orthogonal, the strongest first
/// throws   std::invalid_argument as require_valid, on options out of range or a cost that overflows; std::domain_error
///          if the arithmetic overflows on the way
/// source   Burer and Monteiro, Math. Program. B 95 (2003) 329 (the factorisation); Higham, Accuracy and Stability of
///          Numerical Algorithms, 2nd ed., theorem 10.3 (rounding of Cholesky); weak duality
OptimalityBound prove_bound(const SkinProblem& problem, const OptimalityBoundOptions& options = {});

/// (reached - bound) / bound. NaN where the bound is not above 1e-9 of the cost of silence: a share of nothing says
/// nothing. There the difference itself tells.
double optimality_gap(const OptimalityBound& optimality_bound, double reached, double silence);

}  // namespace touchfield
