#include "solvers/phase/surface_search.h"

#include <vector>

#include "solvers/phase/annealed_start.h"

namespace touchfield {

namespace {

constexpr int kTrial = 3;             // steps from each start
constexpr int kStepsAtFullDrive = 5;  // before these, for starts that have to catch up
constexpr double kDamping = 1e-3;     // of the first step: all starts are near some minimum
constexpr double kStandstill = 1e-4;

}  // namespace

PhaseSolution search_surface(const SkinProblem& problem, const Eigen::MatrixXcd& others, SurfaceOptions options,
                             const IterationCallback& callback) {
  const Eigen::Index channels = problem.channel_count();
  const double level = options.free_level && !options.free_amplitudes ? annealed_level(problem) : 1.0;
  SurfaceOptions first = options;
  first.iterations = kStepsAtFullDrive;
  const auto after_some_steps = [&](const Eigen::VectorXcd& start) {
    return drive(solve_surface(problem, start, first));
  };
  std::vector<Eigen::MatrixXcd> starts = {annealed_starts(problem, level), others,
                                          after_some_steps(Eigen::VectorXcd::Ones(channels))};
  if (level < 1.0) {
    starts.emplace_back(after_some_steps(annealed_start(problem)));
  }
  Eigen::Index count = 0;
  for (const Eigen::MatrixXcd& some : starts) {
    count += some.cols();
  }
  Eigen::MatrixXcd all(channels, count);
  for (const Eigen::MatrixXcd& some : starts) {
    all.middleCols(all.cols() - count, some.cols()) = some;
    count -= some.cols();
  }
  options.trial = kTrial;
  options.initial_damping = kDamping;
  options.standstill = kStandstill;
  return solve_surface(problem, all, options, callback);
}

}  // namespace touchfield
