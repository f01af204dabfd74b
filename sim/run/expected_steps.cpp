#include "sim/run/expected_steps.h"

#include <cmath>

#include "sim/bem/scattering_solver.h"
#include "sim/core/errors.h"
#include "sim/mesh/remesh/surface_remesh.h"
#include "sim/run/accuracy.h"

namespace touchfield {

namespace {

constexpr double kMillerSteps = 25;
constexpr double kPlainSteps = 200;
constexpr Eigen::Index kSmall = 15000;  // faces: the run takes seconds
constexpr double kCoarseEdge = 0.7;     // wavelengths
constexpr double kCaught = 32;          // steps on the coarse copy from which on sound is caught somewhere
constexpr double kGrowth = 0.35;

}  // namespace

double expected_steps(const Model& model, Scheme scheme) {
  if (!traits(scheme).burton_miller) {
    return kPlainSteps;
  }
  const TriangleMesh& mesh = model.body.mesh;
  const double edge = kCoarseEdge * model.fixed->wave.wavelength();
  if (mesh.face_count() <= kSmall || mesh.mean_edge() > 0.7 * edge) {
    return kMillerSteps;
  }
  try {
    const ScatteringSystem system(remeshed_surface(mesh, EdgeSizing(edge)), model.fixed->wave, scheme);
    const Eigen::MatrixXcd b = system.right_hand_side(system.incident(model.fixed->array, free_focus(model)));
    const int steps = make_solver(system, {})->solve(b).report.steps;
    return steps < kCaught ? steps : steps * std::pow(edge / mesh.mean_edge(), kGrowth);
  } catch (const Error&) {  // thinner than the coarse edge somewhere
    return kMillerSteps;
  }
}

}  // namespace touchfield
