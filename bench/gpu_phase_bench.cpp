// A step of `surface` and of `paper` on the processor and on the graphics card, with how far the card's end is off the
// processor's: a table on stdout. Figures depend on the machine and on what else it does.

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <memory>

#include <omp.h>

#include "sim/core/version.h"
#include "sim/gpu/cuda/phase_steps.cuh"
#include "sim/gpu/gpu_library.h"
#include "solvers/linear/blas_product.h"
#include "solvers/phase/incident_problem.h"
#include "solvers/phase/surface.h"
#include "tests/support/skin_support.h"

namespace touchfield {
namespace {

constexpr int kSteps = 20;
constexpr int kRepeats = 5;

/// The least of some runs [ms], after one that counts for nothing.
template <class Work>
double milliseconds(int repeats, const Work& work) {
  double least = 1e300;
  work();
  for (int i = 0; i < repeats; ++i) {
    const auto start = std::chrono::steady_clock::now();
    work();
    least =
        std::min(least, std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count());
  }
  return least;
}

/// As phase_bench has it: the strongest quiet rows some ten times as strong as those of the target, then falling off.
SkinProblem skin_problem(Eigen::Index faces, Eigen::Index rank, Eigen::Index channels) {
  Uniform uniform(1);
  SkinProblem problem;
  problem.target = 0.1 * random_matrix(faces, channels, uniform);
  problem.quiet = random_matrix(rank, channels, uniform);
  for (Eigen::Index i = 0; i < rank; ++i) {
    const double place = static_cast<double>(i) / static_cast<double>(rank);
    problem.quiet.row(i) *= place < 0.4 ? 1.0 - 2.0 * place : 0.2 * std::pow(5e-4, (place - 0.4) / 0.6);
  }
  problem.amplitudes = 0.5 * problem.target.cwiseAbs().rowwise().sum();
  problem.weights = Eigen::VectorXd::Ones(faces);
  return problem;
}

void print(const char* what, Eigen::Index k, Eigen::Index r, Eigen::Index n, double cpu, double card, double error) {
  std::printf("\"%s\",%td,%td,%td,%.3f,%.3f,%.1e\n", what, k, r, n, cpu, card, error);
}

double off(const PhaseSolution& found, const PhaseSolution& expected) {
  return std::abs(found.cost_history.back() / expected.cost_history.back() - 1.0);
}

/// A step; all rows of R count where the damping is next to nothing.
void surface_step(Gpu& gpu, Eigen::Index faces, Eigen::Index rank, Eigen::Index channels, double damping) {
  const SkinProblem problem = skin_problem(faces, rank, channels);
  SkinProblem there = problem;
  move_to(*gpu.phase_device(), there);
  SurfaceOptions options;
  options.iterations = kSteps;
  options.initial_damping = damping;
  const Eigen::VectorXcd start = random_start(channels, 1);
  PhaseSolution expected;
  PhaseSolution found;
  const double cpu = milliseconds(1, [&] { expected = solve_surface(problem, start, options); });
  const double card = milliseconds(kRepeats, [&] { found = solve_surface(there, start, options); });
  print(damping < 1e-4 ? "surface, a step, all rows" : "surface, a step", faces, rank, channels,
        cpu / expected.iterations, card / found.iterations, off(found, expected));
}

void paper_step(Gpu& gpu, Eigen::Index targets, Eigen::Index channels) {
  const Eigen::Index unknowns = targets + channels;
  Uniform uniform(2);
  const Eigen::MatrixXcd c = random_matrix(2 * unknowns, unknowns, uniform);
  const IncidentProblem problem{hermitian_product(c), targets};
  LevenbergMarquardtOptions options;
  options.iterations = kSteps;
  const Eigen::VectorXd start = Eigen::VectorXd::Zero(unknowns);
  PhaseSolution expected;
  const double cpu = milliseconds(1, [&] { expected = solve_incident(problem, start, options); });
  IncidentProblem there = problem;
  move_to(*gpu.phase_device(), there);
  PhaseSolution found;
  const double card = milliseconds(kRepeats, [&] { found = solve_incident(there, start, options); });
  print("paper, a step", targets, 0, channels, cpu / kSteps, card / kSteps, off(found, expected));
}

/// Gram matrix and five steps from B_T and G on the card.
void paper_frame(Gpu& gpu, int rows, int targets, int channels) {
  auto& context = dynamic_cast<cuda::Context&>(gpu);
  Uniform uniform(3);
  const Eigen::MatrixXcf columns = random_matrix(rows, targets, uniform).cast<std::complex<float>>();
  const Eigen::MatrixXcf g = random_matrix(rows, channels, uniform).cast<std::complex<float>>();
  const Eigen::VectorXd ones = Eigen::VectorXd::Ones(std::max(rows, targets));
  cuda::Array<cuComplex> columns_there(context);
  cuda::Array<cuComplex> g_there(context);
  columns_there.upload(reinterpret_cast<const cuComplex*>(columns.data()), static_cast<std::size_t>(columns.size()));
  g_there.upload(reinterpret_cast<const cuComplex*>(g.data()), static_cast<std::size_t>(g.size()));
  Eigen::MatrixXcd c(rows, targets + channels);
  c << columns.cast<std::complex<double>>(), -g.cast<std::complex<double>>();
  LevenbergMarquardtOptions options;
  options.iterations = 5;
  const Eigen::VectorXd start = Eigen::VectorXd::Zero(targets + channels);
  PhaseSolution expected;
  const double cpu = milliseconds(1, [&] {
    expected = solve_incident({hermitian_product(c), targets}, start, options);
  });
  const cuda::PaperMatrices matrices{rows,           targets,     channels,   columns_there.data(),
                                     g_there.data(), ones.data(), ones.data()};
  std::size_t taken = 0;
  const double gram = milliseconds(kRepeats, [&] {
    const auto q = cuda::paper_gram(context, matrices);
    context.synchronize();
    taken = gpu.taken();
  });
  PhaseSolution found;
  const double card = milliseconds(kRepeats, [&] {
    IncidentProblem there{{}, targets};
    there.device = cuda::make_gram_device(context, cuda::paper_gram(context, matrices), targets + channels);
    found = solve_incident(there, start, options);
  });
  print("paper, Gram and five steps", targets, rows, channels, cpu, card, off(found, expected));
  print("of these the Gram matrix", targets, rows, channels, std::nan(""), gram, std::nan(""));
}

int run() {
  if (gpu_library().cards == 0) {
    std::puts(gpu_library().why_none.c_str());
    return 0;
  }
  const auto gpu = open_gpu(0);
  std::printf("# made by: bench/gpu_phase_bench on one %s, CUDA %s, processor with %d threads; revision: %s\n",
              gpu->info().name.c_str(), gpu->info().toolkit.c_str(), omp_get_max_threads(),
              build_info().revision.c_str());
  std::printf("work,k,r,n,processor_ms,card_ms,cost_off\n");
  for (const double damping : {3e-4, 1e-6}) {
    surface_step(*gpu, 60, 130, 640, damping);
    surface_step(*gpu, 150, 280, 640, damping);
    surface_step(*gpu, 60, 130, 1496, damping);
    surface_step(*gpu, 150, 280, 1496, damping);
    surface_step(*gpu, 150, 525, 1496, damping);
  }
  paper_step(*gpu, 170, 1496);
  paper_frame(*gpu, 10000, 170, 1496);
  return 0;
}

}  // namespace
}  // namespace touchfield

int main() { return touchfield::run(); }
