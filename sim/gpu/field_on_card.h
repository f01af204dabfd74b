#pragma once

#include <vector>

#include "sim/acoustics/transducer_array.h"
#include "sim/gpu/gpu.h"
#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

/// What a card makes of the field at points off the skin: see GpuField.
struct FarField {
  Eigen::MatrixXcd pressure;  // J x S [Pa]
  Eigen::VectorXd winding;    // J
  std::vector<int> near;      // J
};

/// The field of a driven array and of the faces that are not near.
///
/// far_distance   in square roots of a face's area
/// points         3 x J [m]
/// surface        M x S [Pa]: pressures on the faces, S > 0
/// drive          N x S
/// throws         GpuMemoryFailure where the card has no room, DeviceError where it fails
FarField far_field_on_card(Gpu& gpu, double far_distance, const TriangleMesh& mesh, const TransducerArray& array,
                           const Wave& wave, const Points& points, const Eigen::MatrixXcd& surface,
                           const Eigen::MatrixXcd& drive);

}  // namespace touchfield
