#pragma once

#include "sim/mesh/remesh/edge_sizing.h"
#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

/// The piece of a closed mesh within `radius` of a point that holds the skin next to the point. Its open ends are
/// closed by the parts of the sphere of that radius that lie in the body. These caps are exact in shape, smooth and
/// inside the body. They also close several parts, and rims within each other. Their faces have the sizing's edge
/// lengths, next to the rim those of the rim. Skin farther away is left out; where skin and cap meet there is an edge.
///
/// Vertices between 0.9 radius and the sphere slide along edges onto it, by at most 0.35 of an edge, so that the rim
/// has no slivers: angles are above 10 degrees but where the skin only grazes the sphere. Bulges of the skin out of the
/// ball and dents of the air into it that are shallower than a quarter of an edge are ignored, and parts that hang
/// together by less than an edge there are taken apart. Faces near the sphere are halved while an edge is above twice
/// the sizing's.
///
/// mesh      closed, oriented outwards, without self-intersections
/// returns   a closed mesh oriented outwards, without self-intersections; vertices within 0.9 radius keep their place,
///           and faces of them their corners. The mesh itself if nothing is farther away
/// throws    InputError if radius is not > 0, no skin is within half of it, or no closed surface without
///           self-intersections results (the body cuts itself there)
TriangleMesh kept_within(const TriangleMesh& mesh, const Vector3& point, double radius, const EdgeSizing& sizing);

}  // namespace touchfield
