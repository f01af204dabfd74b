// Time of the parts of a run against the number of faces and channels. Figures depend on the machine and on what else
// it does: compare them within one run.

#include <benchmark/benchmark.h>

#include "sim/bem/boundary_operator.h"
#include "sim/bem/layer_sum.h"
#include "sim/bem/scattering_solver.h"
#include "sim/bem/scattering_system.h"
#include "sim/hand/shapes.h"
#include "solvers/linear/low_rank.h"

namespace touchfield {
namespace {

constexpr double kRadius = 20e-3;
constexpr int kAbout10000 = 22;  // subdivisions of a sphere of 9,680 faces, 6.3 edges a wavelength

Wave wave() { return {air(293.15), 40e3}; }

TriangleMesh sphere_mesh(std::int64_t subdivisions) { return icosphere(kRadius, static_cast<int>(subdivisions)); }

void count_faces(benchmark::State& state, const TriangleMesh& mesh) {
  state.counters["faces"] = static_cast<double>(mesh.face_count());
}

/// One product with every pair of about 10,000 points; the argument is the number of right-hand sides.
template <typename Real, Layer kLayer>
void matrix_free_product(benchmark::State& state) {
  const TriangleMesh mesh = sphere_mesh(kAbout10000);
  const LayerSum<Real> sum(mesh, wave().wavenumber(), 1.0 / wave().k());
  const Eigen::MatrixXcd x = Eigen::MatrixXcd::Ones(sum.size(), state.range(0));
  for (auto unused : state) {
    benchmark::DoNotOptimize(sum.apply(kLayer, x));
  }
  const auto interactions = static_cast<double>(sum.size() * sum.size());
  state.counters["interactions"] =
      benchmark::Counter(interactions, benchmark::Counter::kIsIterationInvariantRate, benchmark::Counter::kIs1000);
  count_faces(state, mesh);
}
BENCHMARK(matrix_free_product<float, Layer::kDouble>)->Arg(1)->Arg(8)->UseRealTime()->Unit(benchmark::kMillisecond);
BENCHMARK(matrix_free_product<double, Layer::kDouble>)->Arg(1)->Arg(8)->UseRealTime()->Unit(benchmark::kMillisecond);
BENCHMARK(matrix_free_product<float, Layer::kBurtonMiller>)
    ->Arg(1)
    ->Arg(8)
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);
BENCHMARK(matrix_free_product<double, Layer::kBurtonMiller>)
    ->Arg(1)
    ->Arg(8)
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);

void near_corrections(benchmark::State& state) {
  const TriangleMesh mesh = sphere_mesh(state.range(0));
  std::size_t pairs = 0;
  for (auto unused : state) {
    const NearCorrections near(mesh, wave().wavenumber(), 1.0 / wave().k(), Layer::kBurtonMiller, FaceRule{});
    pairs = near.pairs();
  }
  state.counters["pairs"] = static_cast<double>(pairs);
  count_faces(state, mesh);
}
BENCHMARK(near_corrections)->Arg(8)->Arg(kAbout10000)->UseRealTime()->Unit(benchmark::kMillisecond);

void assemble_matrix(benchmark::State& state) {
  const ScatteringSystem system(sphere_mesh(state.range(0)), wave(), Scheme::kBurtonMiller);
  for (auto unused : state) {
    benchmark::DoNotOptimize(system.dense_single());
  }
  count_faces(state, system.mesh());
}
BENCHMARK(assemble_matrix)->Arg(8)->Arg(16)->UseRealTime()->Unit(benchmark::kMillisecond);

template <Precision kPrecision>
void factorise(benchmark::State& state) {
  const ScatteringSystem system(sphere_mesh(state.range(0)), wave(), Scheme::kPaperCorrected);
  for (auto unused : state) {
    benchmark::DoNotOptimize(make_solver(system, {.kind = SolverKind::kLu, .precision = kPrecision}));
  }
  count_faces(state, system.mesh());
}
BENCHMARK(factorise<Precision::kSingle>)->Arg(8)->Arg(12)->Arg(16)->UseRealTime()->Unit(benchmark::kMillisecond);
BENCHMARK(factorise<Precision::kDouble>)->Arg(8)->Arg(12)->Arg(16)->UseRealTime()->Unit(benchmark::kMillisecond);

/// Burton-Miller and a plane wave to a residual of 1e-5, every entry computed anew in every step.
void solve_matrix_free(benchmark::State& state) {
  const ScatteringSystem system(sphere_mesh(state.range(0)), wave(), Scheme::kBurtonMiller);
  const IncidentField field = system.incident(plane_wave(Vector3::UnitZ(), 1.0));
  const auto solver = make_solver(system, {});
  SolveReport report;
  for (auto unused : state) {
    report = solver->solve(system.right_hand_side(field)).report;
  }
  state.counters["steps"] = report.steps;
  state.counters["residual"] = report.residual;
  count_faces(state, system.mesh());
}
BENCHMARK(solve_matrix_free)->Arg(8)->Arg(16)->Arg(kAbout10000)->UseRealTime()->Unit(benchmark::kMillisecond);

TransducerArray paper_array() {
  return make_array(transformed(grid_layout(44, 34, 10.16e-3), Eigen::Matrix3d::Identity(), Vector3(0, 0, -0.2)),
                    Directivity::omni(), 1.0, kAutd3SourceStrength);
}

/// The transfer matrix of 1,496 channels by chief and LU in single precision, not refined. `residual` is by products in
/// double, `bytes` what the factors and the block of right-hand sides take. Compared with LU in double where that is
/// cheap.
void transfer_matrix(benchmark::State& state) {
  const ScatteringSystem system(sphere_mesh(state.range(0)), wave(), Scheme::kChief);
  const TransducerArray array = paper_array();
  const Eigen::MatrixXcd b = system.right_hand_side(system.incident(array));
  const SolverOptions options{.kind = SolverKind::kLu, .refine = false};
  Solved solved;
  for (auto unused : state) {
    solved = make_solver(system, options)->solve(b);
  }
  state.counters["residual"] = solved.report.residual;
  state.counters["unknowns"] = static_cast<double>(system.faces());
  state.counters["bytes"] = benchmark::Counter(solver_memory(system.faces(), options, b.cols()),
                                               benchmark::Counter::kDefaults, benchmark::Counter::kIs1024);
  if (system.faces() < 4000) {
    const auto reference = make_solver(system, {.kind = SolverKind::kLu, .precision = Precision::kDouble});
    const Eigen::MatrixXcd exact = reference->solve(b).x.topRows(system.faces());
    state.counters["error"] = (solved.x.topRows(system.faces()) - exact).norm() / exact.norm();
  }
  count_faces(state, system.mesh());
}
BENCHMARK(transfer_matrix)->Arg(12)->Arg(kAbout10000)->Iterations(1)->UseRealTime()->Unit(benchmark::kMillisecond);

/// The same columns, but only those of a basis of them solved: X = (B^-1 Q) R with b = Q R. `residual` is of some of
/// the columns of b itself, `rank` the number of solves, `left_out` what the basis leaves out.
template <Scheme kScheme, SolverKind kKind>
void compressed_transfer_matrix(benchmark::State& state) {
  const ScatteringSystem system(sphere_mesh(state.range(0)), wave(), kScheme);
  const TransducerArray array = paper_array();
  const Eigen::MatrixXcd b = system.right_hand_side(system.incident(array));
  const SolverOptions options{.kind = kKind, .refine = false, .tolerance = 1e-4};
  LowRank low;
  Solved solved;
  for (auto unused : state) {
    low = compressed(b, 1e-6);
    solved = make_solver(system, options)->solve(low.basis);
  }
  constexpr Eigen::Index kSome = 8;
  Eigen::MatrixXcd right(b.rows(), kSome);
  Eigen::MatrixXcd some(low.rank(), kSome);
  for (Eigen::Index s = 0; s < kSome; ++s) {
    right.col(s) = b.col(s * (b.cols() - 1) / (kSome - 1));
    some.col(s) = low.coefficients.col(s * (b.cols() - 1) / (kSome - 1));
  }
  const Eigen::MatrixXcd x = solved.x * some;
  const Eigen::MatrixXcd residual = system.exact().apply(x) - right;
  state.counters["residual"] = (residual.colwise().norm().array() / right.colwise().norm().array()).maxCoeff();
  state.counters["left_out"] = low.left_out;
  state.counters["rank"] = static_cast<double>(low.rank());
  state.counters["steps"] = solved.report.steps;
  count_faces(state, system.mesh());
}
BENCHMARK(compressed_transfer_matrix<Scheme::kChief, SolverKind::kLu>)
    ->Arg(kAbout10000)
    ->Iterations(1)
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);
BENCHMARK(compressed_transfer_matrix<Scheme::kBurtonMiller, SolverKind::kGmres>)
    ->Arg(kAbout10000)
    ->Iterations(1)
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace touchfield
