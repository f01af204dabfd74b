#pragma once

#include "sim/mesh/body.h"

namespace touchfield {

/// Sphere about the origin: a subdivided icosahedron of 20 f^2 faces, vertices scaled so that the enclosed volume is
/// the sphere's (radius of the vertices slightly above `radius`).
///
/// radius   a [m], > 0
/// edge     wanted edge length [m], > 0; f is chosen so that the mean edge is nearest to it
/// landmarks  top (+z), bottom (-z), x_plus, x_minus, y_plus, y_minus
/// throws   InputError if radius or edge is not positive
Body sphere(double radius, double edge);

/// Icosahedron whose faces are split into f^2 each, projected on the sphere and scaled to its volume; f >= 1.
TriangleMesh icosphere(double radius, int subdivisions);

/// Capsule along y about the origin: a cylinder of length `length` between two half spheres.
///
/// radius, edge   as for sphere
/// length         of the cylinder [m], >= 0
/// landmarks      top, bottom, x_plus, x_minus (middle of the cylinder), y_plus, y_minus (the ends)
Body capsule(double radius, double length, double edge);

/// Box about the origin with the given side lengths [m].
///
/// landmarks   top, bottom, x_plus, x_minus, y_plus, y_minus (middles of the sides)
Body box(const Vector3& size, double edge);

}  // namespace touchfield
