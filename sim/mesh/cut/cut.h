#pragma once

#include "sim/mesh/remesh/edge_sizing.h"
#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

/// The part of a closed mesh on the negative side of a plane, (x - point) . normal <= 0, closed by flat caps. A cap may
/// have any number of rims, one within the other. Its faces have edges as long as those that the plane cuts.
///
/// So that the cut leaves few slivers, a vertex at it slides onto the plane along an edge if that is at most a quarter
/// of the edge, or 2 % where it would leave a crease above 50 degrees or a corner, and short edges of the rim are left
/// out. Where that would make the surface cut itself, it is cut as it is.
///
/// mesh      closed, oriented outwards, without self-intersections (those away from the cut do no harm)
/// normal    any length but 0
/// returns   a closed mesh oriented outwards; faces that share no vertex with one that the plane meets stay as they are
/// accuracy  vertices within 1e-9 m of the plane count as on it; the caps are flat to rounding. What slides changes the
///           volume to second order in the edge over the radius of curvature
/// throws    InputError if nothing or everything is left, or the surface cuts itself at the plane
TriangleMesh cut_by_plane(const TriangleMesh& mesh, const Vector3& point, const Vector3& normal);

/// The piece of a closed mesh within `radius` of a point that holds the skin next to the point. Its open ends are
/// closed by the parts of the sphere of that radius that lie in the body: exact in shape, smooth, inside the body, and
/// between the rims of a finger as well as between those of several parts or of one within another. Their faces have
/// the sizing's edge lengths, next to the rim those of the rim. Skin farther away is left out; where skin and cap meet
/// there is an edge.
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
