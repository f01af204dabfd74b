// Time of an iteration of the phase methods against the number of faces, of channels and of rows. Figures depend on the
// machine and on what else it does: compare them within one run.

#include <cmath>
#include <cstdlib>

#include <benchmark/benchmark.h>

#include "solvers/linear/blas_product.h"
#include "solvers/phase/baselines.h"
#include "solvers/phase/incident_problem.h"
#include "solvers/phase/optimality_bound.h"
#include "solvers/phase/surface.h"

namespace touchfield {
namespace {

constexpr int kIterations = 20;

void count_iterations(benchmark::State& state, int iterations) {
  state.counters["iteration"] =
      benchmark::Counter(iterations, benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}

/// The one-time Gram matrix of method `paper`: faces x (150 target faces + 1,496 channels).
void paper_gram(benchmark::State& state) {
  const Eigen::MatrixXcd c = Eigen::MatrixXcd::Ones(state.range(0), 150 + 1496);
  for (auto unused : state) {
    benchmark::DoNotOptimize(hermitian_product(c));
  }
}
BENCHMARK(paper_gram)->Arg(2500)->Arg(5000)->Arg(10000)->Arg(20000)->UseRealTime()->Unit(benchmark::kMillisecond);

/// A step of method `paper`, K target faces and N channels: how many faces the body has does not matter.
void paper_iteration(benchmark::State& state) {
  const Eigen::Index unknowns = state.range(0) + state.range(1);
  std::srand(1);
  const Eigen::MatrixXcd c = Eigen::MatrixXcd::Random(2 * unknowns, unknowns);
  const IncidentProblem problem{hermitian_product(c), state.range(0)};
  LevenbergMarquardtOptions options;
  options.iterations = kIterations;
  for (auto unused : state) {
    benchmark::DoNotOptimize(solve_incident(problem, Eigen::VectorXd::Zero(unknowns), options));
  }
  count_iterations(state, kIterations);
}
BENCHMARK(paper_iteration)
    ->ArgNames({"K", "N"})
    ->Args({150, 249})
    ->Args({150, 498})
    ->Args({150, 996})
    ->Args({150, 1496})
    ->Args({50, 1496})
    ->Args({500, 1496})
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);

/// K target faces that want half of what reaches them, r outside rows, N channels. As on a whole hand the strongest
/// outside rows are some ten times as strong as those of the target, and they fall off gently over the first two
/// fifths, then by a factor of 2,000.
SkinProblem skin_problem(const benchmark::State& state) {
  const Eigen::Index channels = state.range(2);
  std::srand(1);
  SkinProblem problem;
  problem.target = 0.1 * Eigen::MatrixXcd::Random(state.range(0), channels);
  problem.outside = Eigen::MatrixXcd::Random(state.range(1), channels);
  for (Eigen::Index i = 0; i < state.range(1); ++i) {
    const double place = static_cast<double>(i) / static_cast<double>(state.range(1));
    problem.outside.row(i) *= place < 0.4 ? 1.0 - 2.0 * place : 0.2 * std::pow(5e-4, (place - 0.4) / 0.6);
  }
  problem.amplitudes = 0.5 * problem.target.cwiseAbs().rowwise().sum();
  problem.weights = Eigen::VectorXd::Ones(state.range(0));
  return problem;
}

/// A step of method `surface`.
void surface_iteration(benchmark::State& state) {
  const SkinProblem problem = skin_problem(state);
  SurfaceOptions options;
  options.iterations = kIterations;
  options.initial_damping = 3e-4;  // of the last steps on a hand: how many outside rows take part depends on it
  const Eigen::VectorXcd start = random_start(problem.channel_count(), 1);
  for (auto unused : state) {
    benchmark::DoNotOptimize(solve_surface(problem, start, options));
  }
  count_iterations(state, kIterations);
}
// A finger (r about 160) and a whole hand (r about 450 to 580), then against channels.
BENCHMARK(surface_iteration)
    ->ArgNames({"K", "r", "N"})
    ->Args({50, 160, 1496})
    ->Args({150, 160, 1496})
    ->Args({500, 160, 1496})
    ->Args({150, 450, 1496})
    ->Args({150, 580, 1496})
    ->Args({500, 500, 1496})
    ->Args({150, 160, 249})
    ->Args({150, 160, 498})
    ->Args({150, 160, 996})
    ->Args({150, 160, 3000})
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);

/// A step of the baseline that minimises the same cost.
void lbfgs_iteration(benchmark::State& state) {
  const SkinProblem problem = skin_problem(state);
  BaselineOptions options;
  options.iterations = 20;
  const Eigen::VectorXcd start = random_start(problem.channel_count(), 1);
  for (auto unused : state) {
    benchmark::DoNotOptimize(solve_lbfgs(problem, start, options));
  }
  count_iterations(state, options.iterations);
}
BENCHMARK(lbfgs_iteration)
    ->ArgNames({"K", "r", "N"})
    ->Args({150, 160, 1496})
    ->Args({150, 450, 1496})
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);

/// A step of the optimality bound's relaxation, with a third of what comes once: its start, the reduction and the
/// proof.
void optimality_bound_iteration(benchmark::State& state) {
  const SkinProblem problem = skin_problem(state);
  OptimalityBoundOptions options;
  options.max_iterations = 3;
  for (auto unused : state) {
    benchmark::DoNotOptimize(prove_bound(problem, options));
  }
  count_iterations(state, options.max_iterations);
}
BENCHMARK(optimality_bound_iteration)
    ->ArgNames({"K", "r", "N"})
    ->Args({150, 160, 1496})
    ->Args({500, 500, 1496})
    ->Iterations(1)
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace touchfield
