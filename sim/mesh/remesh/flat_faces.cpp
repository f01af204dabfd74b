#include "sim/mesh/remesh/flat_faces.h"

#include <algorithm>
#include <array>

#include "sim/mesh/face_shape.h"

namespace touchfield {

namespace {

/// Exchanges the flat face's longest edge for the other diagonal, if that leaves two faces with area.
bool flip_away(EditMesh& mesh, const Points& points, int longest, double least) {
  const auto [a, b, c, d] = mesh.corners_about(longest);
  if (!mesh.can_flip(longest) || is_flat(points, {d, c, a}, least) || is_flat(points, {c, d, b}, least)) {
    return false;
  }
  mesh.flip(longest);
  return true;
}

bool collapse_away(EditMesh& mesh, int shortest) {
  for (const int side : {shortest, mesh.opposite(shortest)}) {
    if (mesh.can_collapse(side)) {
      mesh.collapse(side);
      return true;
    }
  }
  return false;
}

bool remove_flat_face(EditMesh& mesh, const Points& points, int first_side, double least) {
  std::array<int, 3> sides = {first_side, first_side + 1, first_side + 2};
  const auto side_length = [&](int side) { return (points.col(mesh.to(side)) - points.col(mesh.from(side))).norm(); };
  std::sort(sides.begin(), sides.end(), [&](int s, int t) { return side_length(s) < side_length(t); });
  // A needle's ends may become one: the skin moves by its short side. Others move nothing by a flip.
  constexpr double kNeedle = 1e-3;
  if (side_length(sides[0]) <= kNeedle * side_length(sides[2]) && collapse_away(mesh, sides[0])) {
    return true;
  }
  return flip_away(mesh, points, sides[2], least);
}

}  // namespace

FlatFaces remove_flat_faces(EditMesh& mesh, const Points& points, double least) {
  FlatFaces result;
  constexpr int kRounds = 20;  // neighbours in a row of flat faces wait for each other
  bool changed = true;
  for (int round = 0; round < kRounds && changed; ++round) {
    changed = false;
    for (int side = 0; side < mesh.side_count(); side += 3) {
      if (!mesh.alive(side) || !is_flat(points, {mesh.from(side), mesh.to(side), mesh.apex(side)}, least)) {
        continue;
      }
      const Vector3 place = points.col(mesh.from(side));
      if (remove_flat_face(mesh, points, side, least)) {
        result.first = result.removed++ == 0 ? place : result.first;
        changed = true;
      }
    }
  }
  return result;
}

}  // namespace touchfield
