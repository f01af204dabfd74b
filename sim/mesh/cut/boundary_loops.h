#pragma once

#include <vector>

#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

/// Closed loops of boundary edges of an oriented, edge-manifold surface, each as vertex numbers. The order of the
/// vertices is that of a filling: its faces are then oriented as their neighbours are. A vertex that several loops
/// touch is in each of them. No loop passes a vertex twice.
///
/// triangles      3 x M
/// vertex_count   > every number in triangles
/// returns        the loops in the order of the first face at them
/// throws         InputError if two faces run the same way along an edge, or a face names a vertex twice
std::vector<std::vector<int>> boundary_loops(const Triangles& triangles, int vertex_count);

}  // namespace touchfield
