#pragma once

#include <cstdint>

#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

/// What a sensor makes of a body: its skin displaced along its normals by smooth noise, and the whole moved.
struct SensingNoise {
  double rms = 0;                    // of the displacement over the skin [m], 0 to 3e-3
  double correlation = 5e-3;         // length L over which it decorrelates [m], 1e-3 to 0.1
  Vector3 offset = Vector3::Zero();  // of the whole body [m]
  std::uint64_t seed = 1;
};

/// The mesh with its vertices moved along smooth normals by a random field of zero mean, Gaussian in value, with the
/// covariance rms^2 exp(-d^2 / (2 L^2)) of points of the skin d apart in space, then by the offset. The field is
/// realised in space (the same seed and noise give the same field at the same point, whatever the mesh), so that a
/// finer mesh of the body gets the same displacement.
///
/// mesh      closed, oriented outwards, without self-intersections
/// returns   the same triangles on moved vertices, without self-intersections
/// throws    InputError on a value out of range, or if the noise makes the skin cut itself even at the reduced slope
///           that the body's thin parts and folds allow; the message says where and which rms would do
TriangleMesh perturbed(const TriangleMesh& mesh, const SensingNoise& noise);

}  // namespace touchfield
