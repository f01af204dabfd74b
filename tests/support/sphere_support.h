#pragma once

#include <cmath>
#include <numbers>

#include "sim/bem/rigid_sphere.h"
#include "sim/bem/scattering_solver.h"
#include "sim/bem/scattering_system.h"
#include "sim/hand/shapes.h"

namespace touchfield {

inline Wave wave() { return {air(293.15), 40e3}; }

inline double radius_of(double ka) { return ka / wave().k(); }

/// Relative error of a pressure on the faces, squares weighted by their areas.
inline double weighted_error(const TriangleMesh& mesh, const Eigen::VectorXcd& p, const Eigen::VectorXcd& exact) {
  return std::sqrt(mesh.areas().dot((p - exact).cwiseAbs2()) / mesh.areas().dot(exact.cwiseAbs2()));
}

inline Eigen::VectorXd cosines(const TriangleMesh& mesh) {
  return mesh.centroids().row(2).transpose().cwiseQuotient(mesh.centroids().colwise().norm().transpose());
}

/// A function of the place, on every face.
inline Eigen::VectorXcd at_centroids(const TriangleMesh& mesh, const auto& function) {
  Eigen::VectorXcd values(mesh.face_count());
  for (Eigen::Index f = 0; f < mesh.face_count(); ++f) {
    values(f) = function(Vector3(mesh.centroids().col(f)));
  }
  return values;
}

inline TransducerArray omni_at(const Points& positions) {
  const Eigen::Index n = positions.cols();
  return make_array({positions, Vector3::UnitZ().replicate(1, n), Eigen::VectorXi::Zero(n), Eigen::VectorXi::Zero(n)},
                    Directivity::omni(), 1.0, 1.0);
}

/// LU where it takes less time or GMRES more steps than are worth while.
inline SolverOptions solver_for(Scheme scheme, Eigen::Index faces) {
  SolverOptions options;
  if (scheme == Scheme::kChief || faces <= 1500) {
    options.kind = SolverKind::kLu;
  }
  return options;
}

struct SphereCase {
  double ka = 0;
  int subdivisions = 0;
  SystemOptions system = {};
  double source_distance = 0;  // of an omni source on +z [m]; 0: a plane wave along +z
  double tolerance = 1e-5;
};

struct SphereResult {
  double error = 0;  // against the series
  SolveReport report;
  Eigen::VectorXcd pressure;
};

inline SphereResult solve_sphere(Scheme scheme, const SphereCase& c) {
  const double radius = radius_of(c.ka);
  const TriangleMesh mesh = icosphere(radius, c.subdivisions);
  const ScatteringSystem system(mesh, wave(), scheme, c.system);
  SolverOptions options = solver_for(scheme, mesh.face_count());
  options.tolerance = c.tolerance;
  if (c.system.grid_tolerance > 0) {
    options.kind = SolverKind::kFft;
  }
  const bool plane = c.source_distance == 0;
  const IncidentField field =
      system.incident(plane ? plane_wave(Vector3::UnitZ(), 1.0) : omni_at(Vector3(0, 0, c.source_distance)));
  const Solved solved = make_solver(system, options)->solve(system.right_hand_side(field));
  const Eigen::VectorXcd exact =
      plane ? rigid_sphere_plane_wave(wave(), radius, cosines(mesh))
            : Eigen::VectorXcd(4.0 * std::numbers::pi *
                               rigid_sphere_point_source(wave(), radius, c.source_distance, cosines(mesh)));
  const Eigen::VectorXcd p = system.pressure(solved.x, field);
  return {weighted_error(mesh, p, exact), solved.report, p};
}

}  // namespace touchfield
