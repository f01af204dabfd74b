#pragma once

#include "sim/acoustics/medium.h"
#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

/// What this machine does now, on all threads, for estimates: measured in a few hundredths of a second.

/// Seconds of one product without near corrections in single precision, one right-hand side.
double product_seconds(const TriangleMesh& mesh, const Wave& wave);

/// Floating-point operations a second of an LU of about half a second.
double measured_flops();

}  // namespace touchfield
