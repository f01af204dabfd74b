// Bad meshes of good bodies: slivers, edges of very different sizes, and what single precision makes of the worst.

#include <algorithm>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "sim/core/units.h"
#include "sim/mesh/query/inspect.h"
#include "tests/hard/hard_support.h"

namespace touchfield::hard_mesh_test {

class HardMesh : public HardCase {};

TransducerArray wave_up() { return plane_wave(Vector3::UnitZ(), 1.0); }

Eigen::VectorXcd exact_on(const TriangleMesh& mesh, const Wave& wave, double radius) {
  return rigid_sphere_plane_wave(wave, radius, cosines(mesh));
}

TEST_P(HardMesh, Slivers) {
  const Wave wave = wave_at(40e3);
  const double ka = sized(5.1, 8.4);
  const double radius = ka / wave.k();
  const TriangleMesh whole = icosphere(radius, sized(6, 11));
  const Answers smooth = answers(whole, wave, wave_up());
  const Errors without = errors(whole.areas(), smooth, exact_on(whole, wave, radius));
  const auto print = [](const std::string& angle, const std::string& measured, const std::string& jump,
                        const TriangleMesh& mesh, const Errors& figures, const Answers& found) {
    print_row("hard_slivers", {Cells{{"nominal angle", angle},
                                     {"measured", measured},
                                     {"sizes of neighbours", jump},
                                     {"faces", fmt::to_string(mesh.face_count())}},
                               scheme_cells({figures}), step_cells(found)});
  };
  print("none", "-", "-", whole, without, smooth);
  for (const double degrees : {10.0, 5.0, 2.0, 1.0}) {
    const TriangleMesh mesh = with_slivers(whole, degrees * kDegree);
    const Answers found = answers(mesh, wave, wave_up());
    const Errors with = errors(mesh.areas(), found, exact_on(mesh, wave, radius));
    const MeshRisks risks = mesh_risks(mesh);
    print(fmt::format("{:g} deg", degrees), fmt::format("{:.1f}", risks.smallest_angle / kDegree),
          fmt::format("{:.1f}", risks.size_jump), mesh, with, found);
    // Slivers cost steps and little accuracy: at most what a mesh of half the edges would.
    EXPECT_LT(with.at(Scheme::kBurtonMillerPolished), 2 * without.at(Scheme::kBurtonMillerPolished));
    EXPECT_LT(with.at(Scheme::kBurtonMiller), 2.5 * without.at(Scheme::kBurtonMiller));
    EXPECT_LT(with.at(Scheme::kPaperCorrected), 0.1);
    const SolveReport& report = found.at(Scheme::kBurtonMiller).report;
    EXPECT_TRUE(report.converged);
    EXPECT_GT(report.steps, 1.5 * smooth.at(Scheme::kBurtonMiller).report.steps);
    EXPECT_LT(report.steps, 200);
  }
}

TEST_P(HardMesh, EdgesOfVeryDifferentSizes) {
  const Wave wave = wave_at(40e3);
  const double radius = 6.96e-3;  // ka 5.10, 12 % from the nearest fictitious frequency
  const auto measure = [&](const std::string& growth, const TriangleMesh& mesh) -> Errors {
    const MeshRisks risks = mesh_risks(mesh);
    const Answers found = answers(mesh, wave, wave_up());
    const Eigen::VectorXcd exact = exact_on(mesh, wave, radius);
    const Eigen::VectorXd fine =
        area_where(mesh, [&](const Vector3& x, const Vector3&) { return (x - Vector3(0, 0, radius)).norm() < 2e-3; });
    const Errors in_all = errors(mesh.areas(), found, exact);
    print_row("hard_grading", {Cells{{"growth", growth},
                                     {"faces", fmt::to_string(mesh.face_count())},
                                     {"range", fmt::format("{:.0f}", risks.size_range)},
                                     {"neighbours", fmt::format("{:.2f}", risks.size_jump)}},
                               scheme_cells({in_all, errors(fine, found, exact)}), step_cells(found)});
    EXPECT_TRUE(found.at(Scheme::kBurtonMiller).report.converged);
    return in_all;
  };
  const Errors even = measure("3 mm everywhere", sphere(radius, 3e-3).mesh);
  for (const double growth : sized(std::vector<double>{0.3}, std::vector<double>{0.6, 0.3, 0.15})) {
    const TriangleMesh mesh = graded_sphere(radius, 0.15e-3, 3e-3, growth);
    EXPECT_GT(mesh_risks(mesh).size_range, 10.0);  // the case is what it says
    const Errors graded = measure(fmt::format("{:.2f}", growth), mesh);
    // The coarse part rules: no better than 3 mm everywhere, and not twice as bad.
    for (const Scheme scheme : all_schemes()) {
      EXPECT_LT(graded.at(scheme), 2 * even.at(scheme)) << to_string(scheme);
    }
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
  double worst_condition = 0;
  for (const auto& [name, mesh] : meshes) {
    for (const Scheme scheme : {Scheme::kPaper, Scheme::kChief, Scheme::kBurtonMiller}) {
      const Answer exact =
          answer(mesh, wave, wave_up(), scheme, {SolverKind::kLu, Precision::kDouble, true, 1e-10, 400, 100});
      const double condition = 1 / exact.rcond;
      // How far off the pressure is, and in how many steps.
      const auto difference = [&, &mesh = mesh](SolverKind kind, bool refine,
                                                double tolerance) -> std::pair<double, int> {
        const Answer single =
            answer(mesh, wave, wave_up(), scheme, {kind, Precision::kSingle, refine, tolerance, 400, 100});
        return {error(mesh.areas(), single.pressure, exact.pressure), single.report.steps};
      };
      const double plain = difference(SolverKind::kLu, false, 1e-6).first;
      const double refined = difference(SolverKind::kLu, true, 1e-8).first;
      const auto [free, steps] = difference(SolverKind::kMatrixFree, false, 1e-5);
      const auto [free_refined, steps_refined] = difference(SolverKind::kMatrixFree, true, 1e-7);
      print_row("hard_single", {{{"mesh", name},
                                 {"faces", fmt::to_string(mesh.face_count())},
                                 {"scheme", letters(scheme)},
                                 {"condition", fmt::format("{:.0f}", condition)},
                                 {"LU unrefined", fmt::format("{:.1e}", plain)},
                                 {"LU refined", fmt::format("{:.1e}", refined)},
                                 {"matrix-free unrefined", fmt::format("{:.1e} ({})", free, steps)},
                                 {"matrix-free refined", fmt::format("{:.1e} ({})", free_refined, steps_refined)}}});
      // Entries are rounded to some 6e-8 and the pressure moves by the condition number times that at most.
      EXPECT_LT(plain, 3e-7 * condition + 3e-6) << name << ' ' << to_string(scheme);
      EXPECT_LT(refined, 1e-7) << name << ' ' << to_string(scheme);
      EXPECT_LT(refined, 0.1 * plain) << name << ' ' << to_string(scheme);
      if (scheme == Scheme::kBurtonMiller) {
        EXPECT_LT(free, 1e-3) << name;          // 1e-5 of residual by the condition, and some
        EXPECT_LT(free_refined, 1e-5) << name;  // the same of 1e-7
      }
      worst_condition = std::max(worst_condition, condition);
    }
  }
  // None of them is near 1e8, where the program calls a system ill_conditioned.
  EXPECT_LT(worst_condition, 1e6);
  EXPECT_GT(worst_condition, 1e3);
}

INSTANTIATE_TEST_SUITE_P(Small, HardMesh, testing::Values(Size::kSmall), testing::PrintToStringParamName());
INSTANTIATE_TEST_SUITE_P(Full, HardMesh, testing::Values(Size::kFull), testing::PrintToStringParamName());

}  // namespace touchfield::hard_mesh_test
