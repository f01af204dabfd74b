// Parts of the skin close to each other: narrow gaps, thin plates, cavities.

#include <cmath>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "sim/core/units.h"
#include "sim/mesh/mesh_risks.h"
#include "sim/mesh/shapes.h"
#include "tests/hard/hard_meshes.h"
#include "tests/hard/hard_support.h"

namespace touchfield {
namespace {

class HardGeometry : public HardCase {};

// Into the gap from the side, off every plane of symmetry.
TransducerArray slanted_wave() { return plane_wave(Vector3(0.2, 0.3, 0.93).normalized(), 1.0); }

/// Prints the errors over the whole body and in the gap of a pair; splits the reference's faces `times` over.
void measure_gap(const std::string& what, const TriangleMesh& one, double gap, int times) {
  const TriangleMesh mesh = pair_of(one, gap);
  const Wave wave = wave_at(40e3);
  const MeshRisks risks = mesh_risks(mesh);
  const Eigen::VectorXcd reference = split_reference(mesh, wave, slanted_wave(), times);
  const Answers found = answers(mesh, wave, slanted_wave());
  const std::string name = fmt::format("{}, {} faces, gap {:.1f} mm ({:.2f} edges by mesh_risks)", what,
                                       mesh.face_count(), gap / kMillimetre, risks.gap);
  print_errors(name, errors(mesh.areas(), found, reference));
  const double middle = one.vertices().row(0).maxCoeff() + 0.5 * gap;
  const Eigen::VectorXd inside = area_where(mesh, [&](const Vector3& x, const Vector3& n) {
    return std::abs(x.x() - middle) < 0.5 * gap + 0.5e-3 && std::abs(n.x()) > 0.8;
  });
  print_errors("  in the gap", errors(inside, found, reference));
  print_steps("  in all", found);
  if (times > 1) {
    const Eigen::VectorXcd once = split_reference(mesh, wave, slanted_wave(), times - 1);
    fmt::print("  reference split once less: {:.2f} % in all, {:.2f} % in the gap\n",
               100 * error(mesh.areas(), once, reference), 100 * error(inside, once, reference));
  }
}

TEST_P(HardGeometry, SpheresAtNarrowGaps) {
  const TriangleMesh one = sphere(5e-3, 1.5e-3).mesh;
  for (const double gap : {5e-3, 1e-3, 0.5e-3, 0.1e-3}) {
    measure_gap("spheres", one, gap, sized(1, 2));
  }
}

TEST_P(HardGeometry, FingersAtNarrowGaps) {
  const TriangleMesh one = sized(capsule(5e-3, 10e-3, 2e-3).mesh, finger(2e-3));
  for (const double gap : {5e-3, 1e-3, 0.5e-3, 0.1e-3}) {
    measure_gap("fingers", one, gap, 1);
  }
}

TEST_P(HardGeometry, ThinPlate) {
  const Wave wave = wave_at(40e3);
  const double side = sized(15e-3, 30e-3);
  for (const double edge : {3e-3, 2e-3, 1e-3}) {
    const TriangleMesh mesh = box({side, 0.8 * side, 2e-3}, edge).mesh;
    const Eigen::VectorXcd reference = split_reference(mesh, wave, slanted_wave());
    const Answers found = answers(mesh, wave, slanted_wave());
    const std::string name = fmt::format("plate 2 mm thick, edge {:.1f} mm, {} faces ({:.2f} edges by mesh_risks)",
                                         edge / kMillimetre, mesh.face_count(), mesh_risks(mesh).thickness);
    print_errors(name, errors(mesh.areas(), found, reference));
    const Eigen::VectorXd dark = area_where(mesh, [](const Vector3&, const Vector3& n) { return n.z() > 0.9; });
    print_errors("  dark side", errors(dark, found, reference));
    print_steps("  in all", found);
  }
}

TEST_P(HardGeometry, TubeClosedAtOneEnd) {
  const Wave wave = wave_at(40e3);
  const TransducerArray into = plane_wave(Vector3(0.2, 0.1, -0.97).normalized(), 1.0);
  for (const double edge : sized(std::vector<double>{1.9e-3}, std::vector<double>{2.6e-3, 1.7e-3, 1.2e-3})) {
    const TriangleMesh mesh = cup(edge);
    const Eigen::VectorXcd reference = split_reference(mesh, wave, into);
    const Answers found = answers(mesh, wave, into);
    const MeshRisks risks = mesh_risks(mesh);
    print_errors(fmt::format("tube, {} faces, {:.1f} edges a wavelength, wall {:.2f} edges", mesh.face_count(),
                             edges_per_wavelength(mesh, wave.wavelength()), risks.thickness),
                 errors(mesh.areas(), found, reference));
    const Eigen::VectorXd inside = area_where(mesh, [](const Vector3& x, const Vector3& n) {
      const bool wall = x.z() < kCupDepth - 2e-3 && x.z() > 0.3e-3 && n.head<2>().dot(x.head<2>()) < 0;
      const bool ground = n.z() > 0.7 && x.z() < 2e-3;
      return wall || ground;
    });
    print_errors(fmt::format("  inside, {:.0f} % of the area, mean |p| {:.2f}", 100 * inside.sum() / mesh.total_area(),
                             mean_amplitude(inside, reference)),
                 errors(inside, found, reference));
    print_steps("  in all", found);
  }
}

INSTANTIATE_TEST_SUITE_P(Small, HardGeometry, testing::Values(Size::kSmall), testing::PrintToStringParamName());
INSTANTIATE_TEST_SUITE_P(Full, HardGeometry, testing::Values(Size::kFull), testing::PrintToStringParamName());

}  // namespace
}  // namespace touchfield
