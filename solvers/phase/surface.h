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
/// faces outside themselves. At |u_j| = 0 a subgradient is taken (see pressure_directions in skin_problem.h), so that
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

/// solve_surface from the most promising of several starts. These are the two lowest of five annealed ones
/// (annealed_starts), zero after five steps, and `others`. Each takes three steps, then the lowest path continues. It
/// ends when `iterations` are done, or when six of them together lower the cost by less than 2e-4 of it. On problems
/// with traps a single start can end at four times the cost. The search takes about twice the time of one of them
/// (docs/phases.md has both figures, over 60 scenes).
///
/// Free amplitudes: fitted_start is followed as well, to its end, and the lower of the two answers is taken. Annealed
/// starts are at full drive. Where the array is far too strong they end in traps with amplitudes, up to 12 % above.
///
/// others    drives, N per column, there may be none: the phases of the frame before, say
/// options   where the level is free the annealed starts have the level that suits them, and if it is below 1 one at
///           full drive joins them, after five steps; trial, damping and standstill are this function's own
/// returns   the way from the start that won; its first cost is that start's
/// throws    as solve_surface
PhaseSolution search_surface(const SkinProblem& problem, const Eigen::MatrixXcd& others, SurfaceOptions options,
                             const IterationCallback& callback = {});

/// How far the channels of a real array may be from their design: rms over the array.
struct ChannelTolerances {
  double phase = 0.0;  // [rad], >= 0
  double gain = 0.0;   // relative, >= 0
  double dead = 0.0;   // share of the channels, 0 to below 1, nobody knows which

  bool any() const { return phase > 0 || gain > 0 || dead > 0; }
};

/// What is known of a channel that is not as designed: it multiplies its drive by g exp(i delta).
struct ChannelMoments {
  double mean;      // |E g exp(i delta)|
  double variance;  // E g^2 - mean^2
};

/// delta normal with mean 0, g with mean 1, both independent of each other and from channel to channel:
///
///   mean = (1 - dead) exp(-phase^2 / 2),   E g^2 = (1 - dead) (1 + gain^2)
ChannelMoments channel_moments(const ChannelTolerances& tolerances);

/// A bound of the expected cost of a skin problem if channels differ from their design:
///
///   E cost <= cost of mean q + variance sum_n u_n |q_n|^2,   u_n = sum_j w_j |h_jn|^2 + sum_i |r_in|^2
///
/// The bound is above E cost by 2 sum_j w_j p'_j (E |p_j| - |E p_j|), where E |p_j| - |E p_j| is about a quarter of the
/// variance of p_j over |E p_j|. This is small against sum_j w_j p'_j^2 where |E p_j| and p'_j are far above the
/// deviation of p_j.
double expected_cost(const SkinProblem& problem, const Eigen::VectorXcd& q, const ChannelTolerances& tolerances);

struct RobustOptions {
  ChannelTolerances tolerances;
  int iterations = kUsualIterations;  // of each turn, >= 1
  bool search = false;                // the first turn also finds starts of its own
};

/// Minimises expected_cost over the phases and one amplitude a <= 1 of all channels. For one a the second part is
/// constant. Phases (method surface at that level) and the level (in closed form) are thus found in turn. This ends
/// when the cost falls by less than a share of 1e-4, or after 30 turns. cost_history has the cost after each turn.
///
/// starts   as of method surface
/// throws   as solve_surface; std::invalid_argument on tolerances out of range
PhaseSolution solve_robust_surface(const SkinProblem& problem, const Eigen::MatrixXcd& starts,
                                   const RobustOptions& options, const IterationCallback& callback = {});

struct AnnealingOptions {
  int width = 2;       // l, 2 to 8
  int descent = 24;    // steps with rows of any direction, >= 1
  int stage = 4;       // steps at each of the eight bounds, >= 1
  double level = 1.0;  // amplitude of all drives, > 0
  unsigned seed = 1;
};

/// Drives of amplitude `level` to start from, by way of a problem with fewer traps. Every drive is a row of l numbers
/// of length `level` together, Y is N x l, and
///
///   F(Y) = sum_j w_j (|h_j Y| - p'_j)^2 + || R Y ||^2
///
/// as in relaxation.h. From random rows F falls by accelerated projected gradient steps. Their length is 1 /
/// ||A||^2 at first, A = [diag(sqrt w) H_T; R]. Then Y is turned so that its first column is the strongest. What is
/// left in the others is bounded more tightly in each stage, while F continues falling:
///
///   sqrt(sum_i>1 |y_ni|^2) <= 0.8 level, 0.65 level, ... 0
///
/// cost      one pass over A in single precision per step; the result is the same to the last bit for every number of
///           threads. Channels in another order have other rows, and may end in another trap
/// throws    std::invalid_argument as require_valid, on options out of range
/// source    Nesterov's acceleration with restarts: O'Donoghue and Candes, Found. Comput. Math. 15 (2015) 715
Eigen::VectorXcd annealed_start(const SkinProblem& problem, const AnnealingOptions& options = {});

/// Annealed starts worth following, and the level for them.
struct AnnealedStarts {
  Eigen::MatrixXcd drives;   // N x 2: of five those of the lowest cost, the lowest first
  Eigen::VectorXcd at_full;  // the first of the five at level 1
  double level = 1.0;        // of `drives`: 1 but where the array is far too strong for what is wanted
};

/// Five of them: on problems with traps they end in different ones, and their costs tell early which is low. Together
/// they cost about as much as 15 steps of solve_surface.
///
/// free_level   whether the level may be below 1: found to a tenth by annealing again and again at the level that was
///              best, and taken if it is below 0.5
AnnealedStarts annealed_starts(const SkinProblem& problem, bool free_level);

}  // namespace touchfield
