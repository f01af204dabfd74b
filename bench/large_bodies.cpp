// A plane wave on the built-in hand, by products through a grid: what setting up, a product and a solution take, with
// and without the two-level preconditioner, and how far they are from direct sums.
// usage: large_bodies POSE EDGE_MM [FAR_MM [FOREARM_MM [TOLERANCE]]]   Edges away from the index fingertip are FAR_MM
// long, 0: everywhere EDGE_MM. Prints a header and a line of CSV.
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
constexpr double kFine = 10e-3;                 // [m] around the fingertip, on a graded mesh
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

Solution solve(const ScatteringSystem& system, SolverKind kind, double tolerance, bool two_level) {
  const IncidentField field = system.incident(plane_wave(Vector3::UnitZ(), 1.0));
  const SolverOptions options{.kind = kind, .tolerance = tolerance, .max_steps = 1000, .two_level = two_level};
  const Solved solved = make_solver(system, options)->solve(system.right_hand_side(field));
  return {solved.report, system.pressure(solved.x, field)};
}

ScatteringSystem system_of(const TriangleMesh& mesh, const Wave& wave, double grid_tolerance) {
  SystemOptions options;
  options.grid_tolerance = grid_tolerance;
  return {mesh, wave, Scheme::kBurtonMillerPolished, options};
}

TriangleMesh graded(const HandOptions& options, double far) {
  const Body whole = hand(options);
  if (far == 0.0) {
    return whole.mesh;
  }
  const Vector3 tip = position(whole.mesh, find_landmark(whole, "index_tip"));
  return hand(options, EdgeSizing(far, {{tip, options.edge, kFine}})).mesh;
}

double relative(const Solution& found, const Solution& exact) {
  return (found.pressure - exact.pressure).norm() / exact.pressure.norm();
}

void measure(const std::string& pose, double edge, double far, double forearm, double tolerance) {
  const Wave wave(air(293.15), 40e3);
  const double gamma = 1.0 / wave.k();
  HandOptions hand_options;
  hand_options.pose = pose;
  hand_options.edge = edge;
  hand_options.forearm = forearm;
  const TriangleMesh mesh = graded(hand_options, far);
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
  Eigen::Index points = 0;
  const Times making = times_of([&] { points = system.two_level()->coarse().size(); });
  Solution found;
  const Times solving = times_of([&] { found = solve(system, SolverKind::kFft, tolerance, true); });
  const double memory = megabytes();
  Solution plain;
  const Times plainly = times_of([&] { plain = solve(system, SolverKind::kFft, tolerance, false); });

  std::string reference = "none,nan,nan,nan";
  if (faces <= kLargestFine) {
    const bool direct = faces <= kLargestDirect;
    const ScatteringSystem fine = system_of(mesh, wave, direct ? 0.0 : 0.1 * kReference);
    const Solution precise = solve(fine, direct ? SolverKind::kMatrixFree : SolverKind::kFft, kReference, false);
    reference = fmt::format("{},{},{:.3g},{:.3g}", direct ? "direct" : "grid", precise.report.steps,
                            relative(found, precise), relative(plain, precise));
  }
  fmt::print(
      "pose,edge_mm,far_mm,forearm_mm,faces,tolerance,step_wavelengths,window,reach_wavelengths,product_cpu_s,"
      "product_error,near_pairs_a_face,set_up_cpu_s,set_up_s,points,two_level_cpu_s,steps,residual,solve_cpu_s,solve_s,"
      "memory_mb,plain_steps,plain_cpu_s,plain_s,reference,reference_steps,difference,plain_difference\n");
  fmt::print("{},{:.4g},{:.4g},{:.4g},{},{},{:.4f},{},{:.4f},{:.4f},{:.3g},{:.1f},{:.3f},{:.3f},", pose, 1e3 * edge,
             1e3 * far, 1e3 * forearm, faces, tolerance, spec.step / wave.wavelength(), spec.width,
             spec.reach / wave.wavelength(), product.processor, product_error,
             static_cast<double>(system.near_pairs()) / static_cast<double>(faces), set_up.processor, set_up.wall);
  fmt::print("{},{:.3f},{},{:.3g},{:.3f},{:.3f},{:.0f},{},{:.3f},{:.3f},{}\n", points, making.processor,
             found.report.steps, found.report.residual, solving.processor, solving.wall, memory, plain.report.steps,
             plainly.processor, plainly.wall, reference);
}

}  // namespace
}  // namespace touchfield

int main(int argc, char** argv) {
  if (argc < 3) {
    std::cerr << "usage: large_bodies POSE EDGE_MM [FAR_MM [FOREARM_MM [TOLERANCE]]]\n";
    return 2;
  }
  try {
    const auto number = [&](int i, double otherwise) { return argc > i ? std::atof(argv[i]) : otherwise; };
    touchfield::measure(argv[1], 1e-3 * number(2, 0), 1e-3 * number(3, 0), 1e-3 * number(4, 0), number(5, 1e-4));
  } catch (const std::exception& error) {
    std::cerr << error.what() << '\n';
    return 1;
  }
  return 0;
}
