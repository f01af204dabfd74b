#pragma once

#include "sim/mesh/edge_sizing.h"
#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

/// The part of a closed mesh on the negative side of a plane, (x - point) . normal <= 0, closed by flat caps.
///
/// mesh      closed, oriented outwards, without self-intersections
/// normal    any length but 0
/// returns   a closed mesh oriented outwards; faces that the plane does not meet stay as they are
/// throws    InputError if nothing or everything is left
TriangleMesh cut_by_plane(const TriangleMesh& mesh, const Vector3& point, const Vector3& normal);

/// The piece of a closed mesh within `radius` of a point that holds the skin next to the point, its open ends closed by
/// smooth caps inside the body, meshed at the sizing's edge lengths. What is outside the ball is left out; the skin
/// within 0.9 radius of the point is not touched.
///
/// returns   a closed mesh oriented outwards, without self-intersections; the mesh itself if nothing is farther away
/// throws    InputError if radius is not > 0, or no skin is within half of it
TriangleMesh kept_within(const TriangleMesh& mesh, const Vector3& point, double radius, const EdgeSizing& sizing);

}  // namespace touchfield
