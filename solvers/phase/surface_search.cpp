#include "solvers/phase/surface_search.h"

#include "solvers/phase/annealed_start.h"

namespace touchfield {

namespace {

constexpr int kTrial = 3;             // steps from each start
constexpr int kStepsAtFullDrive = 5;  // before these, for starts that have to catch up
constexpr double kDamping = 1e-3;     // of the first step: all starts are near some minimum
constexpr double kStandstill = 2e-4;  // of the cost, in six steps

}  // namespace

PhaseSolution search_surface(const SkinProblem& problem, const Eigen::MatrixXcd& others, SurfaceOptions options,
                             const IterationCallback& callback) {
  const Eigen::Index channels = problem.channel_count();
  const AnnealedStarts annealed = annealed_starts(problem, options.free_level);
  SurfaceOptions first = options;
  first.iterations = kStepsAtFullDrive;
  const auto after_some_steps = [&](const Eigen::VectorXcd& start) {
    return drive(solve_surface(problem, start, first));
  };
  const Eigen::VectorXcd from_zero = after_some_steps(Eigen::VectorXcd::Ones(channels));
  const Eigen::MatrixXcd at_full =
      annealed.level < 1.0 ? Eigen::MatrixXcd(after_some_steps(annealed.at_full)) : Eigen::MatrixXcd(channels, 0);
  Eigen::MatrixXcd starts(channels, annealed.drives.cols() + at_full.cols() + 1 + others.cols());
  starts << annealed.drives, at_full, from_zero, others;
  options.trial = kTrial;
  options.initial_damping = kDamping;
  options.standstill = kStandstill;
  if (!options.free_amplitudes) {
    return solve_surface(problem, starts, options, callback);
  }
  // Some steps do not tell which of the two ways ends lower, so both are gone to their ends, each half of the work.
  const auto half = [&](int done) -> IterationCallback {
    return [&callback, done](int iteration, double cost) { callback((done + iteration + 1) / 2, cost); };
  };
  PhaseSolution first_way = solve_surface(problem, starts, options, callback ? half(0) : callback);
  PhaseSolution fitted =
      solve_surface(problem, fitted_start(problem), options, callback ? half(options.iterations) : callback);
  return fitted.cost_history.back() < first_way.cost_history.back() ? fitted : first_way;
}

}  // namespace touchfield
