#pragma once

#include "solvers/phase/optimality_bound.h"
#include "solvers/phase/radiation.h"

namespace touchfield {

/// Options of prove_radiation_bound where nothing else is said.
inline constexpr OptimalityBoundOptions kUsualRadiationBound{.width = 3, .max_iterations = 120, .tolerance = 0.01};

/// A proved lower bound of radiation_cost over all drives |q_n| <= 1, those of full amplitude, of one amplitude and
/// with tolerances among them.
///
/// P_j is linear in X = q q^H: P_j = <M_j, X>, M_j = a h_j^H h_j - b (g_1^H g_1 + g_2^H g_2) with the rows h of
/// B = [F; R] and g of D B. So the cost is a convex quadratic in X. For any r (M) and d <= 0 (N),
///
///   C = 2 sum_j w_j r_j M_j + B^H diag(e) B,   K = 2 sum_j w_j r_j k_j + E_0
///   cost >= constant - sum_j w_j (r_j^2 + 2 r_j P'_j) + <C, X> + a^2 K
///        >= constant - sum_j w_j (r_j^2 + 2 r_j P'_j) + min(0, sum_n d_n + K + N min(0, lambda)),
///
/// lambda the smallest eigenvalue of C - diag d, a^2 = max |q_n|^2.
///
/// r and d come from minimising the cost over X = Y Y^H, Y of N rows of l numbers of length one at most: r = P - P',
/// d_n = min(0, Re y_n^H (C Y)_n). PhaseDescent does so. The Cholesky factorisation of C - diag d + shift in double
/// proves lambda, its rounding bounded a priori. The bound thus holds whatever produced r and d.
///
/// start    drives near which the relaxation begins, N: best those found by solve_radiation
/// cost     per iteration two products of B with l columns; the proof one product of two M' x N matrices and some
///          Cholesky factorisations N x N
/// throws   std::invalid_argument as require_valid, on a start of another size or not finite, options out of range;
///          std::domain_error if the arithmetic overflows on the way
/// source   as prove_bound
OptimalityBound prove_radiation_bound(const RadiationProblem& problem, const Eigen::VectorXcd& start,
                                      const OptimalityBoundOptions& options = kUsualRadiationBound);

}  // namespace touchfield
