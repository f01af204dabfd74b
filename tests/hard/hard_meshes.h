#pragma once

#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

/// The finger of these cases: a capsule of radius 8 mm, 36 mm long.
TriangleMesh finger(double edge);

/// Two copies of a mesh side by side in x, `gap` [m] between their outermost vertices.
TriangleMesh pair_of(const TriangleMesh& mesh, double gap);

/// The same flat surface with every fourth face cut in three about a point that leaves the angle [rad]: over the middle
/// of a side and next to a corner in turn.
TriangleMesh with_slivers(const TriangleMesh& mesh, double angle);

/// Sphere whose edges grow from `finest` at the pole +z by `growth` a metre of distance from it, up to `coarsest`;
/// scaled to the sphere's volume.
TriangleMesh graded_sphere(double radius, double finest, double coarsest, double growth);

/// A tube along z, closed at the bottom, the rim and the outer corner round: inner radius 4.5 mm, depth 25 mm, wall
/// 2.5 mm. Its floor is the plane z = 0 inside.
TriangleMesh cup(double edge);
constexpr double kCupRadius = 4.5e-3;
constexpr double kCupDepth = 25e-3;

}  // namespace touchfield
