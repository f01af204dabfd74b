#include "sim/run/check.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <fstream>
#include <limits>

#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/core/units.h"
#include "solvers/linear/dense_lu.h"

namespace touchfield {

namespace {

constexpr double kMebibyte = 1024.0 * 1024.0;
constexpr double kComplex = 16.0;  // bytes
// Complex operations of an LU; of a product A^H A with both factors read.
constexpr double kLuFlops = 8.0 / 3.0;
constexpr double kGramFlops = 4.0;
constexpr double kCholeskyFlops = 1.0 / 3.0;
constexpr double kKernelSeconds = 25e-9;  // one kernel on one core, about: sine, cosine, square root

/// Memory that can be had without swapping [MiB].
double available_memory() {
  std::ifstream meminfo("/proc/meminfo");
  std::string name;
  double kibibytes = 0;
  std::string unit;
  while (meminfo >> name >> kibibytes >> unit) {
    if (name == "MemAvailable:") {
      return kibibytes / 1024.0;
    }
  }
  return 0.0;
}

/// Floating-point operations per second of an LU on all threads: the better of two of some tenths of a second,
/// since the first one also wakes the threads.
double measured_flops() {
  constexpr Eigen::Index kSize = 1600;
  constexpr int kTrials = 2;
  Eigen::MatrixXcd matrix = Eigen::MatrixXcd::Zero(kSize, kSize);
  for (Eigen::Index j = 0; j < kSize; ++j) {
    for (Eigen::Index i = 0; i < kSize; ++i) {
      matrix(i, j) = std::polar(1.0, static_cast<double>((i * i + 3 * i * j) % 997));
    }
  }
  double fastest = std::numeric_limits<double>::infinity();
  for (int trial = 0; trial < kTrials; ++trial) {
    const auto start = std::chrono::steady_clock::now();
    const DenseLu lu(matrix);
    fastest = std::min(fastest, std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
  }
  return kLuFlops * std::pow(static_cast<double>(kSize), 3) / fastest;
}

}  // namespace

CheckReport check_model(const Scene& scene, const Model& model) {
  CheckReport report;
  report.faces = model.body.mesh.face_count();
  report.channels = model.array.size();
  report.target_faces = scene.target ? build_target(scene, model).size() : 0;
  report.epw_mean = edges_per_wavelength(model.body.mesh, model.wave.wavelength());
  report.epw_min = model.wave.wavelength() / model.report.longest_edge;

  const auto m = static_cast<double>(report.faces);
  const auto n = static_cast<double>(report.channels);
  const auto k = static_cast<double>(report.target_faces);
  double iterations = 0;
  double optimisers = 0;
  for (const MethodSpec& method : scene.solve.methods) {
    if (method.kind == MethodKind::kPaper || method.kind == MethodKind::kUnscattered) {
      iterations += method.iterations;
      ++optimisers;
    }
  }
  if (scene.target && !scene.target->pressure) {
    iterations += 9.0 * scene.solve.methods.front().iterations;  // trials of the pressure's scale
  }
  double points = 0;
  for (const FieldGrid& grid : model.fields) {
    points += static_cast<double>(grid.size());
  }
  const double gram = optimisers > 0 ? (k + n) * (k + n) : 0.0;
  report.memory_mib = kComplex * (m * m + m * (n + 2.0 * k) + 4.0 * gram) / kMebibyte + 100.0;
  report.available_mib = available_memory();
  const double flops = kLuFlops * m * m * m + (optimisers > 0 ? kGramFlops * m * n * n : 0.0) +
                       4.0 * kCholeskyFlops * iterations * std::pow(k + n, 3);  // Cholesky runs on one thread
  report.seconds = flops / measured_flops() + kKernelSeconds * (2.0 * m * m + m * n + points * (m + n));
  return report;
}

void require_memory(const CheckReport& report) {
  if (report.available_mib > 0 && report.memory_mib > report.available_mib) {
    throw InputError(
        fmt::format("the body has {} faces, which need about {:.1f} GiB of memory; {:.1f} GiB are free: choose a "
                    "larger body.edge_mm",
                    report.faces, report.memory_mib / 1024.0, report.available_mib / 1024.0));
  }
}

std::string describe_check(const Scene& scene, const Model& model, const CheckReport& report) {
  const MeshReport& mesh = model.report;
  std::string text = fmt::format("scene {}\n", scene.name);
  text += fmt::format(
      "  medium   c {:.2f} m/s, rho {:.4f} kg/m3, absorption {:.3g} Np/m; {:.3f} kHz, wavelength {:.3f} mm\n",
      model.wave.medium().sound_speed, model.wave.medium().density, model.wave.medium().absorption,
      model.wave.frequency() / 1e3, model.wave.wavelength() / kMillimetre);
  text += fmt::format("  array    {} channels\n", report.channels);
  text += fmt::format("  body     {} faces, {} vertices, {} components, {:.1f} cm2, {:.1f} cm3\n", mesh.faces,
                      mesh.vertices, mesh.components, mesh.area * 1e4, mesh.volume * 1e6);
  text += fmt::format("           edges {:.2f} to {:.2f} mm, mean {:.2f} mm; smallest angle {:.1f} degrees\n",
                      mesh.shortest_edge / kMillimetre, mesh.longest_edge / kMillimetre,
                      model.body.mesh.mean_edge() / kMillimetre, mesh.smallest_angle / kDegree);
  text += fmt::format("           {:.2f} edges a wavelength, {:.2f} at the longest edge\n", report.epw_mean,
                      report.epw_min);
  text += "           closed, manifold, outward: no faults\n";
  if (scene.target) {
    text += fmt::format("  target   {} faces in {} box{}\n", report.target_faces, model.boxes.size(),
                        model.boxes.size() == 1 ? "" : "es");
  }
  for (const FieldGrid& grid : model.fields) {
    text += fmt::format("  field    {}: {} x {} x {} points\n", grid.name, grid.count[0], grid.count[1], grid.count[2]);
  }
  text +=
      fmt::format("  cost     about {:.0f} MiB of memory ({:.0f} MiB free) and {:.0f} s, pictures and files aside\n",
                  report.memory_mib, report.available_mib, report.seconds);
  return text;
}

}  // namespace touchfield
