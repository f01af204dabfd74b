// A step of `surface` and of `paper` on the processor and on the graphics card, with how far the card's end is off the
// processor's: a table on stdout. Figures depend on the machine and on what else it does.

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <memory>
#include <numeric>

#include <omp.h>

#include "sim/core/version.h"
#include "sim/field/skin_problems.h"
#include "sim/gpu/gpu_library.h"
#include "sim/gpu/on_card.h"
#include "sim/hand/hand.h"
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

/// As phase_bench has it: the strongest outside rows some ten times as strong as those of the target, then falling off.
SkinProblem skin_problem(Eigen::Index faces, Eigen::Index rank, Eigen::Index channels) {
  Uniform uniform(1);
  SkinProblem problem;
  problem.target = 0.1 * random_matrix(faces, channels, uniform);
  problem.outside = random_matrix(rank, channels, uniform);
  for (Eigen::Index i = 0; i < rank; ++i) {
    const double place = static_cast<double>(i) / static_cast<double>(rank);
    problem.outside.row(i) *= place < 0.4 ? 1.0 - 2.0 * place : 0.2 * std::pow(5e-4, (place - 0.4) / 0.6);
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
  move_to(gpu, there);
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

/// A frame of `paper` as published, from where the vertices are to the phases: field, columns of B, Gram matrix, five
/// steps.
void paper_frame(const std::shared_ptr<Gpu>& gpu, double edge_mm, int x, int y) {
  constexpr Eigen::Index kTarget = 100;
  constexpr int kFrames = 20;
  HandOptions hand_options;
  hand_options.edge = 1e-3 * edge_mm;
  const Body body = hand(hand_options);
  const TriangleMesh& mesh = body.mesh;
  const Vector3 pad = position(mesh, find_landmark(body, "index_pad"));
  const ArrayLayout layout =
      transformed(grid_layout(x, y, kAutd3Pitch), Eigen::Matrix3d::Identity(), Vector3(pad - Vector3(0, 0, 0.2)));
  const TransducerArray array = make_array(layout, Directivity::t4010a1(), 1.0, kAutd3SourceStrength);
  std::vector<Eigen::Index> faces(static_cast<std::size_t>(mesh.face_count()));
  std::iota(faces.begin(), faces.end(), 0);
  const Eigen::VectorXd distance = (mesh.centroids().colwise() - pad).colwise().norm();
  std::nth_element(faces.begin(), faces.begin() + kTarget, faces.end(),
                   [&](Eigen::Index a, Eigen::Index b) { return distance(a) < distance(b); });
  faces.resize(kTarget);
  const Eigen::VectorXd amplitudes = Eigen::VectorXd::Constant(kTarget, 3000.0);
  const Eigen::VectorXd weights = Eigen::VectorXd::Ones(mesh.face_count());
  const ScatteringSystem system(mesh, Wave(air(293.15), 40e3), Scheme::kPaper);
  LevenbergMarquardtOptions options;
  options.iterations = 5;
  const Eigen::VectorXd start = Eigen::VectorXd::Zero(kTarget + array.size());
  PhaseSolution expected;
  const auto begin = std::chrono::steady_clock::now();
  const IncidentField field = system.incident(array);
  expected = solve_incident(scattered_problem(system.columns(faces), field.pressure,
                                              weighted_gram(field.pressure, weights), amplitudes, weights),
                            start, options);
  const double cpu = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();
  BodyOnCard card(gpu, system, SolverOptions{}, true);
  PhaseSolution found;
  card.incident_problem(array, faces, amplitudes, weights, {}, true);
  const double assembly = milliseconds(kFrames, [&] {
    card.move(mesh);
    card.incident_problem(array, faces, amplitudes, weights, {}, true);
  });
  const double frame = milliseconds(kFrames, [&] {
    card.move(mesh);
    found = solve_incident(card.incident_problem(array, faces, amplitudes, weights, {}, true), start, options);
  });
  print("paper, five steps and what they need", kTarget, mesh.face_count(), array.size(), cpu, frame,
        off(found, expected));
  print("paper, what they need", kTarget, mesh.face_count(), array.size(), std::nan(""), assembly, std::nan(""));
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
  for (const double edge_mm : {8.0, 5.0, 3.0, 2.1}) {
    paper_frame(gpu, edge_mm, 44, 34);
  }
  paper_frame(gpu, 3.0, 16, 16);
  paper_frame(gpu, 3.0, 32, 24);
  paper_frame(gpu, 3.0, 64, 46);
  return 0;
}

}  // namespace
}  // namespace touchfield

int main() { return touchfield::run(); }
