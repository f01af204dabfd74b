// A plane wave on the built-in hand, by products through a grid: what setting up, a product and a solution take, and
// how far both are from direct sums. usage: large_bodies POSE EDGE_MM [TOLERANCE]   Prints a header and a line of CSV.
#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <ctime>
#include <exception>
#include <iostream>
#include <random>
#include <string>
#include <sys/resource.h>

#include <fmt/format.h>

#include "sim/bem/grid_spec.h"
#include "sim/bem/grid_sum.h"
#include "sim/bem/layer_sum.h"
#include "sim/bem/scattering_solver.h"
#include "sim/hand/hand.h"

namespace touchfield {
namespace {

constexpr Eigen::Index kRows = 512;             // of a product that are compared
constexpr double kReference = 1e-6;             // tolerance of the solution that is compared with
constexpr Eigen::Index kLargestDirect = 30000;  // faces up to which that is by direct products
constexpr Eigen::Index kLargestFine = 60000;    // faces up to which that is made, by a finer grid

struct Times {
  double processor, wall;
};

Times now() {
  timespec at{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &at);
  return {static_cast<double>(at.tv_sec) + 1e-9 * static_cast<double>(at.tv_nsec),
          std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count()};
}

/// Seconds of work, all threads together and by the clock.
template <typename Work>
Times times_of(const Work& work) {
  const Times start = now();
  work();
  const Times end = now();
  return {end.processor - start.processor, end.wall - start.wall};
}

double megabytes() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024.0;
}

Eigen::MatrixXcd random_column(Eigen::Index rows) {
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  Eigen::MatrixXcd x(rows, 1);
  for (Complex& value : x.reshaped()) {
    value = {normal(random), normal(random)};
  }
  return x;
}

struct Solution {
  SolveReport report;
  Eigen::VectorXcd pressure;
};

Solution solve(const ScatteringSystem& system, SolverKind kind, double tolerance) {
  const IncidentField field = system.incident(plane_wave(Vector3::UnitZ(), 1.0));
  const SolverOptions options{.kind = kind, .tolerance = tolerance, .max_steps = 1000};
  const Solved solved = make_solver(system, options)->solve(system.right_hand_side(field));
  return {solved.report, system.pressure(solved.x, field)};
}

ScatteringSystem system_of(const TriangleMesh& mesh, const Wave& wave, double grid_tolerance) {
  SystemOptions options;
  options.grid_tolerance = grid_tolerance;
  return {mesh, wave, Scheme::kBurtonMillerPolished, options};
}

void measure(const std::string& pose, double edge, double tolerance) {
  const Wave wave(air(293.15), 40e3);
  const double gamma = 1.0 / wave.k();
  HandOptions hand_options;
  hand_options.pose = pose;
  hand_options.edge = edge;
  TriangleMesh mesh = hand(hand_options).mesh;
  const Eigen::Index faces = mesh.face_count();

  const GridSpec spec = choose_grid(grid_body(mesh), wave.wavenumber(), gamma, 0.1 * tolerance).spec;
  const auto grid = make_grid_sums(mesh, wave.wavenumber(), gamma, spec);
  const Eigen::MatrixXcd x = random_column(faces);
  Eigen::MatrixXcd y = grid->apply(Layer::kBurtonMiller, x);
  const Times product = times_of([&] { y = grid->apply(Layer::kBurtonMiller, x); });
  const Eigen::MatrixXcd exact =
      LayerSum<double>(mesh, wave.wavenumber(), gamma).apply_head(Layer::kBurtonMiller, x, kRows);
  const double product_error = (y.topRows(exact.rows()) - exact).norm() / x.topRows(exact.rows()).norm();

  const ScatteringSystem system = system_of(mesh, wave, 0.1 * tolerance);
  const Times set_up = times_of([&] { system.prepare(); });
  Solution found;
  const Times solving = times_of([&] { found = solve(system, SolverKind::kFft, tolerance); });
  const double memory = megabytes();

  std::string reference = "none,nan,nan,nan";
  if (faces <= kLargestFine) {
    const bool direct = faces <= kLargestDirect;
    const ScatteringSystem fine = system_of(mesh, wave, direct ? 0.0 : 0.1 * kReference);
    const Solution precise = solve(fine, direct ? SolverKind::kMatrixFree : SolverKind::kFft, kReference);
    const Eigen::VectorXcd difference = found.pressure - precise.pressure;
    reference = fmt::format("{},{},{:.3g},{:.3g}", direct ? "direct" : "grid", precise.report.steps,
                            difference.norm() / precise.pressure.norm(),
                            difference.cwiseAbs().maxCoeff() / precise.pressure.cwiseAbs().maxCoeff());
  }
  fmt::print(
      "pose,edge_mm,faces,tolerance,step_wavelengths,window,reach_wavelengths,product_cpu_s,product_error,"
      "near_pairs_a_face,set_up_cpu_s,set_up_s,steps,residual,solve_cpu_s,solve_s,memory_mb,reference,"
      "reference_steps,difference,largest_difference\n");
  fmt::print("{},{:.4g},{},{},{:.4f},{},{:.4f},{:.4f},{:.3g},{:.1f},{:.3f},{:.3f},{},{:.3g},{:.3f},{:.3f},{:.0f},{}\n",
             pose, 1e3 * edge, faces, tolerance, spec.step / wave.wavelength(), spec.width,
             spec.reach / wave.wavelength(), product.processor, product_error,
             static_cast<double>(system.near_pairs()) / static_cast<double>(faces), set_up.processor, set_up.wall,
             found.report.steps, found.report.residual, solving.processor, solving.wall, memory, reference);
}

}  // namespace
}  // namespace touchfield

int main(int argc, char** argv) {
  if (argc < 3) {
    std::cerr << "usage: large_bodies POSE EDGE_MM [TOLERANCE]\n";
    return 2;
  }
  try {
    touchfield::measure(argv[1], 1e-3 * std::atof(argv[2]), argc > 3 ? std::atof(argv[3]) : 1e-4);
  } catch (const std::exception& error) {
    std::cerr << error.what() << '\n';
    return 1;
  }
  return 0;
}
