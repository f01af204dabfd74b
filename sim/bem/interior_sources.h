#pragma once

#include "sim/bem/scattering_system.h"

namespace touchfield {

/// Point sources inside a body: outside, their field solves the same equations, and is known exactly.
struct SourceField {
  Eigen::MatrixXcd value;  // u = exp(ikr) / (4 pi r) at the centroids, M x S [1/m]
  Eigen::MatrixXcd slope;  // du/dn there [1/m2]
};

/// sources   3 x S [m], inside, none on the skin
SourceField source_field(const TriangleMesh& mesh, const Wave& wave, const Points& sources);

/// The incident field for which a scheme's exact solution would be u, from du/dn alone:
///
///   pressure = -S du/dn,   slope = -(1/2 + D') du/dn,   interior = -int g(z, y) du/dn dS,
///
/// with S and D' integrated by the system's FaceRule. What a scheme returns instead of u is its discretisation error,
/// an indicator of its error in scattering on the same mesh.
IncidentField interior_incident(const ScatteringSystem& system, const SourceField& field);

}  // namespace touchfield
