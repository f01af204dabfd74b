#pragma once

#include "sim/mesh/remesh/edge_sizing.h"
#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

/// The piece of a closed mesh within `radius` of a point that holds the skin next to the point. Its open ends are
/// closed by the parts of the sphere of that radius that lie in the body. These caps are exact in shape, smooth and
/// inside the body. They also close several parts, and rims within each other. Their faces have the sizing's edge
/// lengths, next to the rim those of the rim. Skin farther away is left out. Skin and cap meet in an edge.
///
/// Vertices between 0.9 radius and the sphere slide along edges onto it, by at most 0.35 of an edge. The rim then has
/// no slivers: angles are above 10 degrees except where the skin only grazes the sphere. Bulges of the skin out of the
/// ball are ignored if they are shallower than a quarter of an edge. So are dents of the air into the ball. Parts
/// connected by less than an edge there are separated. Faces near the sphere are halved while an edge is longer than
/// twice the sizing's.
///
/// mesh      closed, oriented outwards, without self-intersections
/// returns   a closed mesh oriented outwards, without self-intersections. Vertices within 0.9 radius keep their place,
///           and faces of them their corners. The mesh itself if nothing is farther away
/// throws    InputError if radius is not > 0, no skin is within half of it, or no closed surface without
///           self-intersections results (the body cuts itself there)
TriangleMesh kept_within(const TriangleMesh& mesh, const Vector3& point, double radius, const EdgeSizing& sizing);

}  // namespace touchfield
