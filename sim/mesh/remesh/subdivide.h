#pragma once

#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

/// Every flat face split in four by the middles of its edges. The surface stays the same set of points; faces that
/// shared an edge share its middle, so that a closed manifold stays one. The first vertices are the mesh's own.
///
/// Face f becomes faces 4f, 4f + 1, 4f + 2 at its corners 0, 1, 2, and 4f + 3 in its middle: the centroid of 4f + 3 is
/// that of f, where values on the two meshes can be compared.
TriangleMesh split_faces(const TriangleMesh& mesh);

}  // namespace touchfield
