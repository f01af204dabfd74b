// Parts of the skin close to each other: narrow gaps, thin plates, cavities.

#include <cmath>
#include <map>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "sim/core/units.h"
#include "sim/mesh/query/inspect.h"
#include "tests/hard/hard_support.h"

namespace touchfield::hard_geometry_test {

class HardGeometry : public HardCase {};

// Into the gap from the side, off every plane of symmetry.
TransducerArray slanted_wave() { return plane_wave(Vector3(0.2, 0.3, 0.93).normalized(), 1.0); }

struct GapFigures {
  double edges;   // the gap by mesh_risks
  Errors inside;  // of the faces that look at each other
};

/// Prints the errors over the whole body and in the gap of a pair, a row of hard_gaps; splits the reference's faces
/// `times` over.
GapFigures measure_gap(const std::string& what, const TriangleMesh& one, double gap, int times) {
  const TriangleMesh mesh = pair_of(one, gap);
  const Wave wave = wave_at(40e3);
  const MeshRisks risks = mesh_risks(mesh);
  const Eigen::VectorXcd reference = split_reference(mesh, wave, slanted_wave(), times);
  const Answers found = answers(mesh, wave, slanted_wave());
  const double middle = one.vertices().row(0).maxCoeff() + 0.5 * gap;
  const Eigen::VectorXd inside = area_where(mesh, [&](const Vector3& x, const Vector3& n) {
    return std::abs(x.x() - middle) < 0.5 * gap + 0.5e-3 && std::abs(n.x()) > 0.8;
  });
  const Errors in_gap = errors(inside, found, reference);
  print_row("hard_gaps", {Cells{{"body", what},
                                {"faces", fmt::to_string(mesh.face_count())},
                                {"gap", fmt::format("{:g} mm", gap / kMillimetre)},
                                {"measured", fmt::format("{:.2f}", risks.gap)}},
                          scheme_cells({errors(mesh.areas(), found, reference), in_gap}), step_cells(found)});
  if (times > 1) {
    const Eigen::VectorXcd once = split_reference(mesh, wave, slanted_wave(), times - 1);
    fmt::print("  reference split once less: {:.2f} % in all, {:.2f} % in the gap\n",
               100 * error(mesh.areas(), once, reference), 100 * error(inside, once, reference));
  }
  return {risks.gap, in_gap};
}

/// Wide gaps are as accurate as one body; what is not is below one edge, where the program warns of a narrow_gap.
void expect_gaps(const std::map<double, GapFigures>& gaps) {
  const auto polished = [&](double gap) { return gaps.at(gap).inside.at(Scheme::kBurtonMillerPolished); };
  EXPECT_GT(gaps.at(5e-3).edges, 1.0);
  EXPECT_LT(polished(5e-3), 0.05);
  for (const auto& [gap, figures] : gaps) {
    if (figures.edges >= 1.0) {
      EXPECT_LT(figures.inside.at(Scheme::kBurtonMillerPolished), 0.05) << gap;
      EXPECT_LT(figures.inside.at(Scheme::kPaper), 0.4) << gap;  // fingers resonate inside, too
    }
  }
  // A gap of a tenth of an edge and less: nothing is resolved, and one point a face has no bound.
  EXPECT_LT(gaps.at(0.1e-3).edges, 1.0);
  EXPECT_GT(polished(0.1e-3), 2 * polished(5e-3));
  EXPECT_LT(polished(0.1e-3), 0.5);
  EXPECT_GT(gaps.at(0.1e-3).inside.at(Scheme::kPaper), 0.5);
}

TEST_P(HardGeometry, SpheresAtNarrowGaps) {
  const TriangleMesh one = sphere(5e-3, 1.5e-3).mesh;
  std::map<double, GapFigures> gaps;
  for (const double gap : {5e-3, 1e-3, 0.5e-3, 0.1e-3}) {
    gaps[gap] = measure_gap("spheres", one, gap, sized(1, 2));
  }
  expect_gaps(gaps);
}

TEST_P(HardGeometry, FingersAtNarrowGaps) {
  const TriangleMesh one = sized(capsule(5e-3, 10e-3, 2e-3).mesh, finger(2e-3));
  std::map<double, GapFigures> gaps;
  for (const double gap : {5e-3, 1e-3, 0.5e-3, 0.1e-3}) {
    if (GetParam() == Size::kFull || gap > 4e-3 || gap < 0.2e-3) {
      gaps[gap] = measure_gap("fingers", one, gap, 1);
    }
  }
  expect_gaps(gaps);
}

TEST_P(HardGeometry, ThinPlate) {
  const Wave wave = wave_at(40e3);
  const double side = sized(12e-3, 30e-3);
  std::vector<double> in_all;
  std::vector<double> in_dark;
  for (const double edge : {3e-3, 2e-3, 1e-3}) {
    const TriangleMesh mesh = box({side, 0.8 * side, 2e-3}, edge).mesh;
    const Eigen::VectorXcd reference = split_reference(mesh, wave, slanted_wave());
    const Answers found = answers(mesh, wave, slanted_wave());
    const Eigen::VectorXd dark = area_where(mesh, [](const Vector3&, const Vector3& n) { return n.z() > 0.9; });
    print_row("hard_plate", {Cells{{"edge", fmt::format("{:g} mm", edge / kMillimetre)},
                                   {"faces", fmt::to_string(mesh.face_count())},
                                   {"thickness in edges", fmt::format("{:.2f}", mesh_risks(mesh).thickness)}},
                             scheme_cells({errors(mesh.areas(), found, reference), errors(dark, found, reference)})});
    in_all.push_back(error(mesh.areas(), found.at(Scheme::kBurtonMillerPolished).pressure, reference));
    in_dark.push_back(error(dark, found.at(Scheme::kBurtonMillerPolished).pressure, reference));
  }
  // Two thirds of an edge, one and two edges thick: of no use on the side in shadow, then falling at least as the edge.
  EXPECT_GT(in_dark[0], 0.1);
  EXPECT_LT(in_dark[2], 0.5 * in_dark[1]);
  EXPECT_LT(in_dark[2], 0.06);
  EXPECT_LT(in_all[1], 0.08);
  EXPECT_LT(in_all[2], 0.5 * in_all[1]);
}

TEST_P(HardGeometry, TubeClosedAtOneEnd) {
  const Wave wave = wave_at(40e3);
  const TransducerArray into = plane_wave(Vector3(0.2, 0.1, -0.97).normalized(), 1.0);
  for (const double edge : sized(std::vector<double>{1.9e-3}, std::vector<double>{2.6e-3, 1.7e-3, 1.2e-3})) {
    const TriangleMesh mesh = cup(edge);
    const Eigen::VectorXcd reference = split_reference(mesh, wave, into);
    const Answers found = answers(mesh, wave, into);
    const Eigen::VectorXd inside = area_where(mesh, [](const Vector3& x, const Vector3& n) {
      const bool wall = x.z() < kCupDepth - 2e-3 && x.z() > 0.3e-3 && n.head<2>().dot(x.head<2>()) < 0;
      const bool ground = n.z() > 0.7 && x.z() < 2e-3;
      return wall || ground;
    });
    const Errors in_tube = errors(inside, found, reference);
    print_row("hard_cavities", {Cells{{"body", "tube"}}, mesh_cells(mesh, wave),
                                scheme_cells({errors(mesh.areas(), found, reference), in_tube}), step_cells(found)});
    fmt::print("wall {:.2f} edges; inside {:.0f} % of the area, mean |p| {:.2f}\n", mesh_risks(mesh).thickness,
               100 * inside.sum() / mesh.total_area(), mean_amplitude(inside, reference));
    // The tube resonates: from 4.5 edges a wavelength on its pressure is met, at 3.3 it is not.
    const double epw = edges_per_wavelength(mesh, wave.wavelength());
    if (epw > 4.5) {
      EXPECT_LT(in_tube.at(Scheme::kBurtonMillerPolished), 0.08);
      EXPECT_GT(in_tube.at(Scheme::kPaper), 1.2 * in_tube.at(Scheme::kBurtonMillerPolished));
    } else {
      EXPECT_GT(in_tube.at(Scheme::kBurtonMillerPolished), 0.15);
    }
    // Waves that go to and fro in the tube take several times the 16 steps of a finger, not hundreds.
    EXPECT_GT(found.at(Scheme::kBurtonMiller).report.steps, 30);
    EXPECT_LT(found.at(Scheme::kBurtonMiller).report.steps, 150);
  }
}

INSTANTIATE_TEST_SUITE_P(Small, HardGeometry, testing::Values(Size::kSmall), testing::PrintToStringParamName());
INSTANTIATE_TEST_SUITE_P(Full, HardGeometry, testing::Values(Size::kFull), testing::PrintToStringParamName());

}  // namespace touchfield::hard_geometry_test
