#include "solvers/phase/robust_surface.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "solvers/phase/skin_field.h"
#include "solvers/phase/surface_search.h"

namespace touchfield {

namespace {

constexpr int kMostTurns = 30;
constexpr double kSettledShare = 1e-4;  // of the cost, in a turn

/// sum_n u_n: what the deviations of all channels at amplitude 1 add, per variance.
double deviation_of_all(const SkinProblem& problem) {
  return problem.weights.dot(problem.target.rowwise().squaredNorm()) + problem.outside.squaredNorm();
}

/// The same problem for fields that are `factor` times as strong.
SkinProblem scaled(const SkinProblem& problem, double factor) {
  return {.target = factor * problem.target,
          .amplitudes = problem.amplitudes,
          .weights = problem.weights,
          .outside = factor * problem.outside};
}

}  // namespace

ChannelMoments channel_moments(const ChannelTolerances& tolerances) {
  if (!(tolerances.phase >= 0 && tolerances.gain >= 0 && tolerances.dead >= 0 && tolerances.dead < 1) ||
      !std::isfinite(tolerances.phase) || !std::isfinite(tolerances.gain)) {
    throw std::invalid_argument("channel tolerances: phase and gain must be >= 0, dead must be 0 to below 1");
  }
  const double alive = 1.0 - tolerances.dead;
  const double mean = alive * std::exp(-0.5 * tolerances.phase * tolerances.phase);
  return {mean, alive * (1.0 + tolerances.gain * tolerances.gain) - mean * mean};
}

double expected_cost(const SkinProblem& problem, const Eigen::VectorXcd& q, const ChannelTolerances& tolerances) {
  const ChannelMoments moments = channel_moments(tolerances);
  const Eigen::VectorXd energy = q.cwiseAbs2();
  const double target = problem.weights.dot(problem.target.cwiseAbs2() * energy);
  const double outside = problem.outside.rows() > 0 ? (problem.outside.cwiseAbs2() * energy).sum() : 0.0;
  return skin_cost(problem, moments.mean * q) + moments.variance * (target + outside);
}

PhaseSolution solve_robust_surface(const SkinProblem& problem, const Eigen::MatrixXcd& starts,
                                   const RobustOptions& options, const IterationCallback& callback) {
  const ChannelMoments moments = channel_moments(options.tolerances);
  const double added = moments.variance * deviation_of_all(problem);
  const SurfaceOptions each{.iterations = options.iterations};
  PhaseSolution best;
  best.status = PhaseStatus::kIterationLimit;
  Eigen::MatrixXcd from = starts;
  double level = 1.0;
  double cost = HUGE_VAL;
  for (int turn = 1; turn <= kMostTurns && best.status != PhaseStatus::kConverged; ++turn) {
    const SkinProblem at_level = scaled(problem, moments.mean * level);
    const bool search = turn == 1 && options.search;
    const PhaseSolution found =
        search ? search_surface(at_level, from, each, {}) : solve_surface(at_level, from, each, {});
    const Eigen::VectorXcd phasors = drive(found);
    level = std::min(1.0, best_level(problem, moments.mean * phasors, added));
    const double now = skin_cost(problem, moments.mean * level * phasors) + level * level * added;
    best.status = cost - now < kSettledShare * now ? PhaseStatus::kConverged : PhaseStatus::kIterationLimit;
    best.iterations += found.iterations;
    if (now < cost) {
      best.phases = found.phases;
      best.amplitudes = Eigen::VectorXd::Constant(phasors.size(), level);
      from = phasors;
      cost = now;
    }
    best.cost_history.push_back(cost);
    if (callback) {
      callback(turn, cost);
    }
  }
  return best;
}

}  // namespace touchfield
