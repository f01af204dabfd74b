#pragma once

#include "solvers/phase/phase_solution.h"
#include "solvers/phase/skin_problem.h"

namespace touchfield {

/// The field's common methods on the same transfer matrix. H is the K x N matrix of the target, p' the wanted
/// amplitudes, of faces on the border their mean (SkinProblem::face_means). Only lbfgs includes the faces' weights and
/// the skin outside the target.
///
/// All return amplitudes of 1: where a method finds drives of several amplitudes, only their phases are kept.
/// cost_history is skin_cost; the methods that never form drives on the way leave it empty. Faces without sound wanted
/// (p' = 0) or without reach (h_j = 0) take no part and are not counted among the K. Channels that reach none of the
/// other faces keep the phase they start with, 0 where there is no start. In lbfgs faces take part as they do in
/// skin_cost. There channels that reach no face and no skin outside the target keep their phase. Nothing is random.
///
/// start    drives, N: only their phases count, 0 where a drive is 0
/// throws   std::invalid_argument as require_valid, on a start of another size or not finite, or iterations < 1
struct BaselineOptions {
  int iterations = 100;  // at most; >= 1
};

/// Gerchberg-Saxon: u = H q, q <- exp(i arg(H^H (p' exp(i arg u)))).
///
/// Each step maximises Re(q^H H^H (p' exp(i theta))) over theta, then over q, so that sum_j p'_j |u_j| never falls:
/// that is its own measure, not skin_cost. kConverged once no drive moves by more than 1e-10.
///
/// source   Gerchberg and Saxon, Optik 35 (1972) 237; for ultrasound Marzo and Drinkwater, PNAS 116 (2019) 84
PhaseSolution solve_gs(const SkinProblem& problem, const Eigen::VectorXcd& start, const BaselineOptions& options,
                       const IterationCallback& callback = {});

/// Weighted Gerchberg-Saxon: the same with p'_j v_j for p'_j, which evens the points out. Before each step, from v = 1,
///
///   v_j <- v_j mean(|u| / p') / (|u_j| / p'_j),   then divided by their mean.
///
/// |u_j| / p'_j counts as 1e-3 of its mean at least, v_j as 1e-6 at least: a point in deep shadow draws much, never
/// all.
///
/// source   Di Leonardo, Ianni, Ruocco, Opt. Express 15 (2007) 1913
PhaseSolution solve_wgs(const SkinProblem& problem, const Eigen::VectorXcd& start, const BaselineOptions& options,
                        const IterationCallback& callback = {});

/// GS-PAT: Gerchberg-Saxon among the K points alone. With B = H^H diag(1 / sum_n |h_jn|^2), each point's own focus, and
/// A = H B (K x K, unit diagonal), from p = p':
///
///   g = A p,   p_j <- p'_j g_j / |g_j|;   at last p_j <- p'_j^2 g_j / |g_j|^2 and the phases of B p.
///
/// The last step's factor p'_j / |g_j| is 1e3 at most. kConverged once no p_j turns by more than 1e-10. The channels'
/// amplitudes are never constrained on the way: an iteration costs K^2, not K N, and cost_history stays empty.
///
/// source   Plasencia, Hirayama, Montano-Murillo, Subramanian, ACM Trans. Graph. 39 (2020) 138
PhaseSolution solve_gs_pat(const SkinProblem& problem, const BaselineOptions& options);

/// Eigensolver. The points' phases theta come from the dominant eigenvector of M = H H^H diag(p'_j / sum_n |h_jn|^2). M
/// holds what a focus of the wanted amplitude on one point does at another. The result is the phases of the drives that
/// minimise
///
///   || H q - p' exp(i theta) ||^2 + sum_n s_n^2 |q_n|^2,   s_n^2 = sum_j p'_j |h_jn| / K,
///
/// the published regularisation at exponent 1. s_n^2 counts as 1e-12 of its largest at least. Where several
/// eigenvectors share the largest eigenvalue, one of them is taken.
///
/// throws   also std::domain_error as hermitian_eigen, and where the system is singular to rounding: K > N and p' below
///          about 1e-16 of what the channels reach
/// source   Long, Seah, Carter, Subramanian, ACM Trans. Graph. 33 (2014) 181
PhaseSolution solve_eigen(const SkinProblem& problem);

/// Minimises skin_cost over the phases by limited-memory BFGS of rank 60 (PhaseDescent). It has converged (kConverged,
/// after 0 iterations too) when a step lowers the cost by less than 1e-10 of itself. It also has when the gradient is
/// below 1e-10 of the cost of the start or of silence, whichever is greater. Otherwise it ends after
/// options.iterations, or where no step along the gradient lowers the cost (kStalled).
PhaseSolution solve_lbfgs(const SkinProblem& problem, const Eigen::VectorXcd& start, const BaselineOptions& options,
                          const IterationCallback& callback = {});

}  // namespace touchfield
