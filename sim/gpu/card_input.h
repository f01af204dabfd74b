#pragma once

#include "sim/acoustics/transducer_array.h"
#include "sim/gpu/gpu.h"
#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

/// An array and a surface in a medium as the card takes them: pointers into the arguments, which must outlive them.
///
/// response   factors(array.response)
GpuSources card_sources(const TransducerArray& array, const Eigen::VectorXcd& response);
GpuBodySpec card_surface(const TriangleMesh& mesh, const Wave& wave);

}  // namespace touchfield
