#pragma once

#include "solvers/phase/phase_solution.h"
#include "solvers/phase/skin_problem.h"

namespace touchfield {

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

}  // namespace touchfield
