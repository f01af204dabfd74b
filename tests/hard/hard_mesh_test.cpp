// Bad meshes of good bodies: slivers, edges of very different sizes, and what single precision makes of the worst.

#include <cmath>
#include <numbers>
#include <utility>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "sim/bem/rigid_sphere.h"
#include "sim/core/units.h"
#include "sim/mesh/mesh_risks.h"
#include "sim/mesh/shapes.h"
#include "tests/hard/hard_meshes.h"
#include "tests/hard/hard_support.h"

namespace touchfield {
namespace {

class HardMesh : public HardCase {};

TransducerArray wave_up() { return plane_wave(Vector3::UnitZ(), 1.0); }

Eigen::VectorXcd exact_on(const TriangleMesh& mesh, const Wave& wave, double radius) {
  return rigid_sphere_plane_wave(
      wave, radius,
      mesh.centroids().row(2).transpose().cwiseQuotient(mesh.centroids().colwise().norm().transpose()));
}

TEST_P(HardMesh, Slivers) {
  const Wave wave = wave_at(40e3);
  const double ka = sized(5.1, 8.4);
  const double radius = ka / wave.k();
  const TriangleMesh whole = icosphere(radius, sized(6, 11));
  print_errors(fmt::format("no slivers, {} faces, ka {:.1f}", whole.face_count(), ka),
               errors(whole.areas(), answers(whole, wave, wave_up()), exact_on(whole, wave, radius)));
  for (const double degrees : {10.0, 5.0, 2.0, 1.0}) {
    const TriangleMesh mesh = with_slivers(whole, degrees * kDegree);
    const Answers found = answers(mesh, wave, wave_up());
    print_errors(fmt::format("slivers of {:.0f} degrees ({:.2f} by mesh_risks, sizes jump {:.1f} times), {} faces",
                             degrees, mesh_risks(mesh).smallest_angle / kDegree, mesh_risks(mesh).size_jump,
                             mesh.face_count()),
                 errors(mesh.areas(), found, exact_on(mesh, wave, radius)));
    print_steps("  in all", found);
  }
}

TEST_P(HardMesh, EdgesOfVeryDifferentSizes) {
  const Wave wave = wave_at(40e3);
  const double radius = 6.96e-3;  // ka 5.10, 12 % from the nearest fictitious frequency
  const auto measure = [&](const std::string& what, const TriangleMesh& mesh) {
    const MeshRisks risks = mesh_risks(mesh);
    const Answers found = answers(mesh, wave, wave_up());
    const Eigen::VectorXcd exact = exact_on(mesh, wave, radius);
    print_errors(fmt::format("{}, {} faces, edges differ {:.0f} times, neighbours {:.2f} times", what,
                             mesh.face_count(), risks.size_range, risks.size_jump),
                 errors(mesh.areas(), found, exact));
    const Eigen::VectorXd fine = area_where(
        mesh, [&](const Vector3& x, const Vector3&) { return (x - Vector3(0, 0, radius)).norm() < 2e-3; });
    print_errors("  within 2 mm of the pole", errors(fine, found, exact));
    print_steps("  in all", found);
  };
  measure("sphere, 3 mm everywhere", sphere(radius, 3e-3).mesh);
  for (const double growth : sized(std::vector<double>{0.3}, std::vector<double>{0.6, 0.3, 0.15})) {
    measure(fmt::format("sphere, 0.15 to 3 mm, growing {:.2f} a metre", growth),
            graded_sphere(radius, 0.15e-3, 3e-3, growth));
  }
}

TEST_P(HardMesh, SinglePrecisionOnTheWorstConditioned) {
  const Wave wave = wave_at(40e3);
  const TriangleMesh ball = icosphere(std::numbers::pi / wave.k(), sized(5, 9));
  const std::vector<std::pair<std::string, TriangleMesh>> meshes = {
      {"fictitious sphere", ball},
      {"slivers of 1 degree", with_slivers(ball, kDegree)},
      {"edges 0.15 to 3 mm", graded_sphere(6.96e-3, 0.15e-3, 3e-3, 0.3)},
      {"gap 0.1 mm", pair_of(capsule(5e-3, 10e-3, sized(2e-3, 1.5e-3)).mesh, 0.1e-3)},
      {"plate 2 mm", box({15e-3, 12e-3, 2e-3}, sized(2e-3, 1e-3)).mesh},
      {"tube", cup(sized(2.6e-3, 1.7e-3))}};
  for (const auto& [name, mesh] : meshes) {
    for (const Scheme scheme : {Scheme::kPaper, Scheme::kChief, Scheme::kBurtonMiller}) {
      SolverOptions options;
      options.kind = SolverKind::kLu;
      options.precision = Precision::kDouble;
      options.tolerance = 1e-10;
      const Answer exact = answer(mesh, wave, wave_up(), scheme, options);
      std::string line = fmt::format("{}, {} faces, {}: condition {:.1e};", name, mesh.face_count(), to_string(scheme),
                                     1 / exact.rcond);
      for (const SolverKind kind : {SolverKind::kLu, SolverKind::kMatrixFree}) {
        for (const bool refine : {false, true}) {
          options.kind = kind;
          options.precision = Precision::kSingle;
          options.refine = refine;
          options.tolerance = refine ? 1e-8 : 1e-6;
          const Answer single = answer(mesh, wave, wave_up(), scheme, options);
          line += fmt::format(" {} {} {:.1e} ({} steps);", to_string(kind), refine ? "refined" : "unrefined",
                              error(mesh.areas(), single.pressure, exact.pressure), single.report.steps);
        }
      }
      fmt::print("{}\n", line);
      std::fflush(stdout);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Small, HardMesh, testing::Values(Size::kSmall), testing::PrintToStringParamName());
INSTANTIATE_TEST_SUITE_P(Full, HardMesh, testing::Values(Size::kFull), testing::PrintToStringParamName());

}  // namespace
}  // namespace touchfield
