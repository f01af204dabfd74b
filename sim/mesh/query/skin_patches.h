#pragma once

#include <functional>
#include <vector>

#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

/// Small flat triangles of skin, each of which stands for the skin round it.
struct SkinPatches {
  Points corners{3, 0};      // 3 x 3 J [m]: those of patch j are the columns 3 j to 3 j + 2
  Eigen::VectorXd areas{};   // J: of the skin that a patch stands for [m2]
  Eigen::VectorXd faces{};   // J: how many faces of its mesh it stands for
  std::vector<int> owner{};  // J: number of the body that it is of, ascending

  Eigen::Index size() const { return areas.size(); }
  bool empty() const { return size() == 0; }

  Points centres() const;  // 3 x J [m]
  Points normals() const;  // 3 x J, unit length
  /// The patches as faces of a mesh, in their order, no two with a common corner. There must be one.
  TriangleMesh mesh() const;
};

/// Every face of a mesh cut into n^2 equal triangles, n the least number for which none has an edge longer than
/// `longest` [m].
///
/// owner   of all of them
SkinPatches pieces_of(const TriangleMesh& mesh, double longest, int owner);

/// The patches j for which keep(j) holds, in their order.
SkinPatches picked(const SkinPatches& patches, const std::function<bool(Eigen::Index)>& keep);

/// Appends patches of a body with a higher number.
void append(const SkinPatches& more, SkinPatches& patches);

/// Pieces spread over the skin, each of them the farthest from all before it (through space). In the end no piece is
/// farther than `apart` [m] from a chosen one. At least `least` pieces are chosen, or all. Each stands for the pieces
/// nearest to it, by the sum of their areas and faces. O(pieces x patches).
SkinPatches spread(const SkinPatches& pieces, double apart, Eigen::Index least);

}  // namespace touchfield
