// Time of the parts of a run against the number of faces and channels. Figures depend on the machine and on what else
// it does: compare them within one run.

#include <benchmark/benchmark.h>

#include "sim/bem/operators.h"
#include "sim/bem/scattering_system.h"
#include "sim/mesh/shapes.h"
#include "solvers/linear/hermitian_product.h"
#include "solvers/phase/incident_problem.h"

namespace touchfield {
namespace {

Wave wave() { return {air(293.15), 40e3}; }

void matrix_free_product(benchmark::State& state) {
  const TriangleMesh mesh = icosphere(20e-3, static_cast<int>(state.range(0)));
  const PaperOperator op(mesh, wave());
  const Eigen::MatrixXcd x = Eigen::MatrixXcd::Ones(op.size(), 1);
  for (auto unused : state) {
    benchmark::DoNotOptimize(op.apply(x));
  }
  const auto interactions = static_cast<double>(op.size() * op.size());
  state.counters["faces"] = static_cast<double>(op.size());
  state.counters["interactions"] =
      benchmark::Counter(interactions, benchmark::Counter::kIsIterationInvariantRate, benchmark::Counter::kIs1000);
}
BENCHMARK(matrix_free_product)->Arg(8)->Arg(16)->Arg(22)->UseRealTime()->Unit(benchmark::kMillisecond);

void assemble_matrix(benchmark::State& state) {
  const TriangleMesh mesh = icosphere(20e-3, static_cast<int>(state.range(0)));
  for (auto unused : state) {
    benchmark::DoNotOptimize(paper_matrix(mesh, wave()));
  }
  state.counters["faces"] = static_cast<double>(mesh.face_count());
}
BENCHMARK(assemble_matrix)->Arg(8)->Arg(16)->UseRealTime()->Unit(benchmark::kMillisecond);

void factorise(benchmark::State& state) {
  const ScatteringSystem system(icosphere(20e-3, static_cast<int>(state.range(0))), wave(), Scheme::kPaper);
  for (auto unused : state) {
    benchmark::DoNotOptimize(factorise_dense(system));
  }
  state.counters["faces"] = static_cast<double>(system.size());
}
BENCHMARK(factorise)->Arg(8)->Arg(12)->Arg(16)->UseRealTime()->Unit(benchmark::kMillisecond);

void gram_matrix(benchmark::State& state) {
  const Eigen::MatrixXcd g = Eigen::MatrixXcd::Ones(state.range(0), 1496);
  for (auto unused : state) {
    benchmark::DoNotOptimize(hermitian_product(g));
  }
}
BENCHMARK(gram_matrix)->Arg(2500)->Arg(10000)->UseRealTime()->Unit(benchmark::kMillisecond);

/// One step of method `paper`: 150 target faces and the given number of channels.
void paper_iteration(benchmark::State& state) {
  const Eigen::Index unknowns = 150 + state.range(0);
  std::srand(1);
  const Eigen::MatrixXcd c = Eigen::MatrixXcd::Random(2 * unknowns, unknowns);
  const IncidentProblem problem{hermitian_product(c), 150};
  LevenbergMarquardtOptions options;
  options.iterations = 5;
  for (auto unused : state) {
    benchmark::DoNotOptimize(solve_incident(problem, Eigen::VectorXd::Zero(unknowns), options));
  }
  state.counters["iterations"] =
      benchmark::Counter(5, benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}
BENCHMARK(paper_iteration)->Arg(249)->Arg(996)->Arg(1496)->UseRealTime()->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace touchfield
