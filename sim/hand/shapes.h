#pragma once

#include <string>
#include <vector>

#include "sim/hand/body.h"

namespace touchfield {

const std::vector<std::string>& shape_landmark_names();

/// Sphere about the origin: a subdivided icosahedron of 20 f^2 faces, vertices scaled so that the enclosed volume is
/// the sphere's (radius of the vertices slightly above `radius`).
///
/// radius   a [m], > 0
/// edge     wanted edge length [m], > 0; f is chosen so that the mean edge is nearest to it
/// landmarks  top (+z), bottom (-z), x_plus, x_minus, y_plus, y_minus
/// throws   InputError if radius or edge is not positive
Body sphere(double radius, double edge);

/// Icosahedron whose faces are split into f^2 each along equal arcs, projected on the sphere and scaled to its volume.
///
/// subdivisions   f, 1 to 500
TriangleMesh icosphere(double radius, int subdivisions);

/// Capsule along y about the origin: a cylinder of length `length` between two half spheres. The vertices lie at one
/// distance from its axis, slightly above `radius`, at which the enclosed volume is the capsule's (to 1e-9).
///
/// radius   a [m], > 0
/// length   of the cylinder [m], >= 0
/// edge     wanted edge length [m], > 0, met by the mean edge within 3 %; one above the radius is taken as the radius
/// landmarks  top, bottom, x_plus, x_minus (middle of the cylinder), y_plus, y_minus (the ends)
/// throws   InputError on a value out of range, or more than a million faces
Body capsule(double radius, double length, double edge);

/// Box about the origin, exact in shape: squares of nearly equal size, cut in two.
///
/// size        side lengths [m], > 0
/// edge        wanted edge length [m], > 0: the faces have about the area of equilateral triangles of this side
/// throws      InputError on a value out of range, or more than 5 million faces
/// landmarks   top, bottom, x_plus, x_minus, y_plus, y_minus (middles of the sides)
Body box(const Vector3& size, double edge);

}  // namespace touchfield
