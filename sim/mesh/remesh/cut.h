#pragma once

#include "sim/mesh/remesh/mesh_quality.h"
#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

/// The largest of the distances from a point along the axes: a cube about it of half side d is where this is < d [m].
inline double cube_distance(const Vector3& x, const Vector3& centre) { return (x - centre).cwiseAbs().maxCoeff(); }

/// Share of `reach` within which kept_within leaves the skin as it is.
inline constexpr double kUncut = 0.9;

/// The piece of a closed mesh that holds the skin nearest to a point. It lies in the cube about the point whose sides
/// are `reach` from it along the axes. Its open ends are closed by flat caps. Skin and cap meet in an edge. The caps,
/// and the skin farther than kUncut of `reach` along an axis, have faces of the sizing's edge lengths.
///
/// mesh      closed, oriented outwards
/// returns   a closed mesh oriented outwards that does not intersect itself near the cut. Faces whose corners are all
///           nearer than kUncut of `reach` are the mesh's own, or halves of them. The mesh itself if it is all in the
///           cube. The cube may be up to 6 % larger or smaller than asked, where its sides graze the skin otherwise
/// throws    InputError if reach is not > 0, no skin is within half of it, or no such cube leaves a closed surface
///           without intersections (the body intersects itself there)
TriangleMesh kept_within(const TriangleMesh& mesh, const Vector3& point, double reach, const EdgeSizing& sizing);

}  // namespace touchfield
