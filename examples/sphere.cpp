// Boundary elements by hand, without a scene: the pressure of a plane wave on a rigid sphere, against the analytic
// series, at three edge lengths.
#include <cstdio>
#include <exception>

#include <touchfield/sim/bem/rigid_sphere.h>
#include <touchfield/sim/bem/scattering_solver.h>
#include <touchfield/sim/hand/shapes.h>

namespace {

constexpr double kRadius = 10e-3;    // [m]
constexpr double kFrequency = 40e3;  // [Hz]

void solve(const touchfield::Wave& wave, double edges_a_wavelength) {
  const touchfield::Body body = touchfield::sphere(kRadius, wave.wavelength() / edges_a_wavelength);
  const touchfield::TransducerArray source = touchfield::plane_wave(Eigen::Vector3d::UnitZ(), 1.0);

  // B p = b: the system knows the mesh and the scheme, the solver how to invert B.
  const touchfield::ScatteringSystem system(body.mesh, wave, touchfield::Scheme::kBurtonMillerPolished);
  const touchfield::IncidentField incident = system.incident(source);
  const auto solver = touchfield::make_solver(system, {.kind = touchfield::SolverKind::kMatrixFree});
  const touchfield::Solved solved = solver->solve(system.right_hand_side(incident));
  const Eigen::VectorXcd p = system.pressure(solved.x, incident);

  const touchfield::TriangleMesh& mesh = system.mesh();
  const Eigen::VectorXd cos_theta = mesh.centroids().colwise().normalized().row(2).transpose();
  const Eigen::VectorXcd exact = touchfield::rigid_sphere_plane_wave(wave, kRadius, cos_theta);
  const double error = (p - exact).cwiseAbs2().dot(mesh.areas()) / exact.cwiseAbs2().dot(mesh.areas());
  std::printf("%5td faces, %.1f edges per wavelength, %d GMRES steps: error %.3f %%\n", mesh.face_count(),
              touchfield::edges_per_wavelength(mesh, wave.wavelength()), solved.report.steps, 100 * std::sqrt(error));
}

}  // namespace

int main() {
  try {
    const touchfield::Wave wave(touchfield::air(touchfield::kRoomTemperature), kFrequency);
    std::printf("ka = %.2f\n", wave.k() * kRadius);
    for (const double edges : {4.0, 6.0, 8.0}) {
      solve(wave, edges);
    }
  } catch (const std::exception& error) {
    std::fprintf(stderr, "sphere: %s\n", error.what());
    return 1;
  }
}
