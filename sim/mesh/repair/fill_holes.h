#pragma once

#include <array>
#include <vector>

#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

/// Closed loops of boundary edges of an oriented, edge-manifold surface, each as vertex numbers in the order in which a
/// filling must run through them to be oriented as its neighbours are. A vertex that several loops touch is in each; no
/// loop passes a vertex twice.
///
/// triangles      3 x M
/// vertex_count   > every number in triangles
/// returns        the loops in the order of the first face at them
/// throws         InputError if two faces run the same way along an edge, or a face names a vertex twice
std::vector<std::vector<int>> boundary_loops(const Triangles& triangles, int vertex_count);

/// Triangulation of one loop without new vertices, oriented along it: the least sum of areas among those that bend
/// least (the largest dihedral angle, with the faces beyond the loop too, counts first). Bends count as equal where
/// 1 - cos of the angle is the same within 1e-4, areas within 1e-6, and there the shorter edges win; faces without
/// area are taken only if nothing else is left.
///
/// points     3 x V
/// loop       3 or more distinct vertex numbers
/// around     faces of the surface, all or those at the loop; those along an edge of the loop are the faces beyond it,
///            and an edge that they have between two vertices of the loop is not used again if it can be avoided
/// returns    loop.size() - 2 triangles
/// throws     InputError if the loop has more than 2000 vertices
/// source     Barequet and Sharir, CAGD 12 (1995) 207; Liepa, Filling holes in meshes, SGP 2003
std::vector<std::array<int, 3>> fill_loop(const Points& points, const std::vector<int>& loop,
                                          const Triangles& around = Triangles(3, 0));

}  // namespace touchfield
