#pragma once

#include <cstddef>
#include <utility>
#include <vector>

#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

/// Pairs of faces of a mesh that cut each other, each pair once, the lower face first, in order. Faces that share an
/// edge or a vertex count only if they overlap beyond it: they are folded onto each other, or one pierces the other.
/// Faces that only touch (within 1e-9 of their size) do not count.
///
/// most      stops after so many pairs
/// accuracy  decided in double precision
std::vector<std::pair<Eigen::Index, Eigen::Index>> self_intersections(const TriangleMesh& mesh,
                                                                      std::size_t most = 1000);

/// Pairs (face of one, face of other) of two meshes that cut each other.
std::vector<std::pair<Eigen::Index, Eigen::Index>> intersections(const TriangleMesh& one, const TriangleMesh& other,
                                                                 std::size_t most = 1000);

}  // namespace touchfield
