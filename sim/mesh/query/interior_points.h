#pragma once

#include <cstdint>

#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

/// Points inside a closed surface, spread evenly but on no lattice and no plane of symmetry. They are darts thrown in a
/// fixed random order, at most eight per cube of side `spacing`. A dart is kept if it has the clearance and is at least
/// 0.8 spacings from all kept before. The same mesh gives the same points; they move with the mesh but are others in
/// place when it turns.
///
/// mesh        closed, outward normals; any genus and number of pieces
/// spacing     [m], > 0
/// clearance   least distance to the skin [m], >= 0
/// edges       the same in edges of the nearest face, each the side of the equilateral triangle of its area, >= 0
/// returns     3 x N [m]. In the bulk one point a spacing^3 within 10 %, a few more where the part that has the
///             clearance is thin. Wherever a ball of radius 0.87 spacings has the clearance, a point is nearer than
///             1.67 spacings to its centre. 3 x 0 if no dart has the clearance
/// throws      InputError on a value out of range, or more than 20 million darts
Points spaced_interior_points(const TriangleMesh& mesh, double spacing, double clearance, double edges = 0.0);

/// Places for point sources inside a closed surface. The fields of such sources are known outside and show how accurate
/// a solution is.
///
/// The first half (rounded up) lie within `reach` of `target`, among the deeper half of the places there. The others
/// are spread over the whole body. Both are as far apart as a greedy choice finds them. Each is at least 1.5 local
/// edges from the skin. The local edge is the side of the equilateral triangle with the area of the nearest face. If
/// the part within reach has too few such places, the whole body gives more. Places are off axes and planes of
/// symmetry.
///
/// mesh     closed, outward normals
/// target   [m], on the skin
/// reach    [m], > 0
/// count    > 0
/// seed     the same mesh and seed give the same points
/// returns  3 x count [m]
/// throws   InputError on a value out of range, or if the body is nowhere deeper than 1.5 local edges at 0.95 of the
///          way to its middle; the message names the depth and the edge where it comes closest
Points interior_sources(const TriangleMesh& mesh, const Vector3& target, double reach, int count, std::uint64_t seed);

}  // namespace touchfield
