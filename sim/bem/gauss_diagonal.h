#pragma once

#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

/// The diagonal of scheme `paper_corrected` from the static Gauss identity,
///
///   B_ii = 1 + sum over j != i of A_j n_j.(x_i - x_j) / (4 pi r^3),
///
/// with which a constant pressure is solved exactly at k = 0: near 1/2, more where the surface bends outwards.
Eigen::VectorXd gauss_diagonal(const TriangleMesh& mesh);

}  // namespace touchfield
