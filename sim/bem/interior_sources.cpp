#include "sim/bem/interior_sources.h"

#include <numbers>

#include "sim/bem/grid_spec.h"

namespace touchfield {

namespace {

/// One layer's product with near integrals done by the rule; the self terms are the caller's.
Eigen::MatrixXcd layer_product(const ScatteringSystem& system, Layer layer, const Eigen::MatrixXcd& x) {
  const Complex wavenumber = system.wave().wavenumber();
  Eigen::MatrixXcd y = system.sums().apply(layer, x);
  const bool rough = system.options().grid_tolerance >= kFinestSingleGrid;
  const auto numbers = rough ? NearCorrections::Numbers::kSingle : NearCorrections::Numbers::kDouble;
  NearCorrections(system.mesh(), wavenumber, 0.0, layer, system.options().rule, numbers).add_product(1.0, x, y);
  return y;
}

}  // namespace

SourceField source_field(const TriangleMesh& mesh, const Wave& wave, const Points& sources) {
  SourceField field{Eigen::MatrixXcd(mesh.face_count(), sources.cols()),
                    Eigen::MatrixXcd(mesh.face_count(), sources.cols())};
  const Complex ik = Complex(0, 1) * wave.wavenumber();
#pragma omp parallel for schedule(static)
  for (Eigen::Index s = 0; s < sources.cols(); ++s) {
    for (Eigen::Index f = 0; f < mesh.face_count(); ++f) {
      const Vector3 offset = mesh.centroids().col(f) - sources.col(s);
      const double r = offset.norm();
      const Complex g = std::exp(ik * r) / (4.0 * std::numbers::pi * r);
      field.value(f, s) = g;
      field.slope(f, s) = (ik - 1.0 / r) * g * (offset.dot(mesh.normals().col(f)) / r);
    }
  }
  return field;
}

IncidentField interior_incident(const ScatteringSystem& system, const SourceField& field) {
  const TriangleMesh& mesh = system.mesh();
  const Complex wavenumber = system.wave().wavenumber();
  IncidentField incident;
  incident.pressure = -layer_product(system, Layer::kSingle, field.slope);
  for (Eigen::Index f = 0; f < mesh.face_count(); ++f) {
    incident.pressure.row(f) -= self_integrals(face_of(mesh, f), wavenumber).single * field.slope.row(f);
  }
  incident.slope = -0.5 * field.slope - layer_product(system, Layer::kAdjoint, field.slope);
  incident.interior =
      -LayerSum<double>(mesh, wavenumber, 0.0).rows(Layer::kSingle, system.interior_points()) * field.slope;
  return incident;
}

}  // namespace touchfield
