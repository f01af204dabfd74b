#pragma once

#include "sim/field/metrics.h"
#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

/// What flows in through a closed surface in air without absorption: the force on what it holds [N]. The stress,
/// averaged over time, of peaks p and v = grad p / (i omega rho):
///
///   S_ij = (|p|^2 / (4 rho c^2) - rho |v|^2 / 4) delta_ij + rho Re(v_i conj(v_j)) / 2
///
/// shell      its normals outwards, its faces far below the wavelength
/// pressure   of points, 3 x J [m] -> J [Pa]; slopes are differences over 0.4 mm
Vector3 momentum_inflow(const TriangleMesh& shell, const Wave& wave, const auto& pressure) {
  constexpr double kStep = 2e-4;
  const double density = wave.medium().density;
  Eigen::Matrix3Xcd velocity(3, shell.face_count());
  for (int axis = 0; axis < 3; ++axis) {
    const auto at = [&](double offset) -> Eigen::VectorXcd {
      return pressure(Points(shell.centroids().colwise() + offset * Vector3::Unit(axis)));
    };
    velocity.row(axis) = ((at(kStep) - at(-kStep)) / (2.0 * kStep * Complex(0, wave.omega() * density))).transpose();
  }
  const Eigen::VectorXcd p = pressure(shell.centroids());
  Vector3 inflow = Vector3::Zero();
  for (Eigen::Index f = 0; f < shell.face_count(); ++f) {
    const Eigen::Vector3cd v = velocity.col(f);
    const Vector3 n = shell.normals().col(f);
    const double even = radiation_per_square(wave.medium()) * std::norm(p(f)) - density * v.squaredNorm() / 4.0;
    inflow -= shell.areas()(f) * (even * n + 0.5 * density * (v * v.dot(n.cast<Complex>())).real());
  }
  return inflow;
}

/// The force on the faces of a rigid body by their radiation pressures [N].
inline Vector3 force_on_faces(const TriangleMesh& mesh, const Wave& wave, const Eigen::VectorXcd& pressure) {
  const Eigen::VectorXd radiation = radiation_pressure(SurfaceGradient(mesh, wave.k()), wave, pressure);
  return -mesh.normals() * mesh.areas().cwiseProduct(radiation);
}

}  // namespace touchfield
