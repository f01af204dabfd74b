#pragma once

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

/// Pairs of faces of a mesh that cut each other, each pair once, the lower face first, in order. Faces that share an
/// edge or a vertex count only if they overlap beyond it. They are then folded onto each other, or one pierces the
/// other. Faces that only touch (within 1e-9 of the longest edge of both) do not count. Faces in one plane, to the same
/// tolerance, count if they overlap in it. A skin that goes through another only along edges of both, to 1e-9, is not
/// detected.
///
/// mesh      open or closed
/// most      stops after so many pairs; those found do not depend on the number of threads
/// accuracy  decided in double precision; a million faces of a closed skin take some seconds on one core
std::vector<std::pair<Eigen::Index, Eigen::Index>> self_intersections(const TriangleMesh& mesh,
                                                                      std::size_t most = 1000);

/// "3 pairs of faces intersect, the first near (..) mm", from the pairs that self_intersections found; empty if there
/// are none.
std::string self_intersections_text(const TriangleMesh& mesh,
                                    const std::vector<std::pair<Eigen::Index, Eigen::Index>>& pairs, std::size_t most);

/// Pairs (face of one, face of other) of two meshes that cut each other, in order; the same rules.
std::vector<std::pair<Eigen::Index, Eigen::Index>> intersections(const TriangleMesh& one, const TriangleMesh& other,
                                                                 std::size_t most = 1000);

}  // namespace touchfield
