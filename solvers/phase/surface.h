#pragma once

#include "solvers/phase/phase_solution.h"
#include "solvers/phase/skin_problem.h"

namespace touchfield {

struct SurfaceOptions {
  int iterations = kUsualIterations;  // steps tried, accepted or not, from the start that continues; >= 1
  int trial = 3;                      // of them, from each start where there are several; >= 1
  bool free_amplitudes = false;       // bounded 0..1 beside the phases; else all 1
  bool free_level = false;            // one amplitude of all drives, where these are not free, may be below 1
  double initial_damping = 0.01;      // tau: mu_0 = tau max diag(J J^T); > 0
  double gradient_tolerance = 1e-10;  // converged if max |J^T f| <= this times the cost; >= 0
  double step_tolerance = 1e-10;      // converged if |h| <= this (1 + |x|); >= 0
  double cost_tolerance = 0.0;        // converged if an accepted step lowers the cost by less than this share; >= 0
  double standstill = 0.0;            // converged if six steps together lower the cost by less than this share; >= 0
};

/// Minimises skin_cost over the phases, and the amplitudes if they are free. The method is Levenberg-Marquardt with
/// Madsen's damping in the small system. With the residual f (K + 2 r) and its Jacobian J along the tangents i q_n,
///
///   f = [ sqrt(w_j) (|h_j q| - p'_j);  Re R q;  Im R q ],
///   h = -D^-1 J^T (J D^-1 J^T + I)^-1 f,   D = mu I + 0.3 diag(max(0, -Re(conj(q_n) g_n))),
///   phi_n += (h_n + b_n) / |q_n|,   b = -D^-1 J^T (J D^-1 J^T + I)^-1 f'' / 2,   2 |b| <= 0.3 |h|,
///
/// f'' is the residual's second derivative along h (see SkinJacobian). b, by the same factor, is the geodesic
/// acceleration. It follows the bend of a narrow valley, where without it half as many steps again are needed. Where
/// amplitudes move too, phi_n += atan(h_n / |q_n|). g is the cost's half gradient in the plane of q_n. The diagonal is
/// a share of the curvature of |q_n| = 1. Rows at the end of R that are weaker than the damping stay out of J^T J (see
/// SkinJacobian::leave_out_up_to, mu). They stay in the cost and its gradient. They bend the model less than the
/// damping does. Where N < K + 2 r the N x N system (J^T J + D) h = -J^T f is solved instead. The matrix is formed and
/// factorised in single precision, and the step is refined in double to 1e-8. Where that fails, all of it is in double.
///
/// From several starts `trial` steps each are taken, and the path that is lowest then continues.
///
/// Free level: all drives have one amplitude, at first that of the start's loudest. If that is below 1, it is set to
/// its best value (best_level) after each step, else only at the end. An array that is too strong for what is wanted is
/// thus turned down.
///
/// Free amplitudes: the start's phases settle first if it is at full drive. Then drives move in the disc |q_n| <= 1.
/// Those on its edge that the cost pulls outwards move along the edge only. A step that pushes a drive out is cut at
/// the edge.
///
/// The cost never rises. An iteration costs O((K + 2r)^2 N), r of the rows that are not left out, and never touches the
/// faces outside themselves. At |u_j| = 0 a subgradient is taken (see pressure_directions in skin_field.h), so that
/// silence is left. A start at any other stationary point, saddle points and the maxima of symmetric arrays too, is
/// returned as converged after 0 iterations.
///
/// starts    drives, N per column: their phases, 0 where a drive is 0 (and amplitudes, clipped to 0..1, if these or
///           the level are free)
/// returns   kConverged too where the fall that the model promises is below the rounding of the cost; kStalled if no
///           damping up to 1e30 times the first helps
/// throws    std::invalid_argument as require_valid, on no start or one of another size or not finite, options out of
///           range
/// source    Madsen, Nielsen, Tingleff, Methods for Non-Linear Least Squares Problems, 2004, ch. 3.2 (damping); Coleman
///           and Li, SIAM J. Optim. 6 (1996) 418 (damping towards a bound); Transtrum, Machta, Sethna, Phys. Rev. E 83
///           (2011) 036701 (geodesic acceleration)
PhaseSolution solve_surface(const SkinProblem& problem, const Eigen::MatrixXcd& starts, const SurfaceOptions& options,
                            const IterationCallback& callback = {});

/// Drives of amplitude 1 to start from.
///
/// adjoint    the field sent back from the target: arg(H_T^H diag(w) p')
/// spectral   arg of the channels' part q of the relaxed problem: least z^H Q z, z = [y; q], over
///            |y|^2 = K, |q|^2 <= N (b_j = sqrt(w_j) p'_j; faces with p' = 0 take no part). Q alone is singular for
///            r < N, so that its eigenvector says nothing; with the price epsilon >= 1e-10 max eig(A A^H) of drive
///            energy, A = [diag(sqrt w) H_T; R], at which |q|^2 = N (to 1 % of epsilon), y is the eigenvector of the
///            smallest eigenvalue of diag(b) epsilon (A A^H + epsilon)^-1_TT diag(b) and
///            q = A^H (A A^H + epsilon)^-1 [b y; 0]. Costs O((K + r)^3)
/// random     angles from the generator's bits directly
/// fitted     phases and amplitudes q = A^H (A A^H + epsilon)^-1 [b y; 0], clipped to 1, epsilon 1e-6 max eig(A A^H)
///            or the power of ten above at which |q|^2 <= N; the phases y are those of the pressures that q makes,
///            found in 30 rounds from y = 1: as even as the target lets them be
///
/// A channel that gets nothing has phase 0.
/// throws     std::invalid_argument as require_valid; random_start on a negative number of channels
Eigen::VectorXcd adjoint_start(const SkinProblem& problem);
Eigen::VectorXcd spectral_start(const SkinProblem& problem);
Eigen::VectorXcd fitted_start(const SkinProblem& problem);
Eigen::VectorXcd random_start(Eigen::Index channels, unsigned seed);

}  // namespace touchfield
