#include "sim/mesh/pieces.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>

#include "sim/mesh/face_shape.h"
#include "sim/mesh/face_tree.h"

namespace touchfield {

namespace {

using Index = Eigen::Index;

/// The faces that have an area, those of pieces of negative volume turned round, so that every piece looks outwards.
TriangleMesh outward_mesh(const Points& points, const Triangles& triangles, const Pieces& pieces) {
  Triangles outward(3, triangles.cols());
  Index count = 0;
  for (Index f = 0; f < triangles.cols(); ++f) {
    if (is_flat(points, triangles.col(f))) {
      continue;
    }
    outward.col(count) = triangles.col(f);
    const int piece = pieces.of_face[static_cast<std::size_t>(f)];
    if (pieces.list[static_cast<std::size_t>(piece)].volume < 0) {
      std::swap(outward(1, count), outward(2, count));
    }
    ++count;
  }
  outward.conservativeResize(3, count);
  return {points, std::move(outward)};
}

}  // namespace

bool Piece::flat() const {
  constexpr double kFlat = 1e-9;  // volume over area^1.5, 0.094 for a sphere: rounding leaves 1e-16 times the distance
  return std::abs(volume) <= kFlat * std::pow(area, 1.5);
}

Pieces find_pieces(const Points& points, const Triangles& triangles, const std::vector<Side>& sides) {
  DisjointSets faces(triangles.cols());
  for_each_edge(sides, [&](std::span<const Side> edge) {
    for (const Side& other : edge.subspan(1)) {
      faces.join(edge[0].face, other.face);
    }
  });
  int count = 0;
  Pieces pieces{faces.numbered(count), {}};
  pieces.list.resize(static_cast<std::size_t>(count), {-1, 0, 0.0, 0.0});
  for (Index f = 0; f < triangles.cols(); ++f) {
    Piece& piece = pieces.list[static_cast<std::size_t>(pieces.of_face[static_cast<std::size_t>(f)])];
    piece.face = piece.faces++ == 0 ? f : piece.face;
    const Vector3 twice_area = twice_area_vector(points, triangles.col(f));
    piece.area += 0.5 * twice_area.norm();
    // About a point of its own: a piece far from the origin loses no digits.
    const Vector3 from_first = points.col(triangles(0, f)) - points.col(triangles(0, piece.face));
    piece.volume += from_first.dot(twice_area) / 6.0;
  }
  return pieces;
}

std::vector<bool> nested(const Points& points, const Triangles& triangles, const Pieces& pieces) {
  std::vector<bool> is_nested(pieces.list.size(), false);
  if (pieces.list.size() < 2) {
    return is_nested;
  }
  const TriangleMesh mesh = outward_mesh(points, triangles, pieces);
  const FaceTree tree(mesh);

  // Just outside a piece that looks outwards the piece itself counts 0 and each one round it 1.
  constexpr double kLift = 1e-3;  // of the face's size
  const auto winding_outside = [&](Index f) {
    return tree.winding_number(mesh.centroids().col(f) + kLift * std::sqrt(mesh.areas()(f)) * mesh.normals().col(f));
  };
  std::vector<std::vector<Index>> faces_of(pieces.list.size());
  Index number = 0;
  for (Index f = 0; f < triangles.cols(); ++f) {
    if (!is_flat(points, triangles.col(f))) {
      faces_of[static_cast<std::size_t>(pieces.of_face[static_cast<std::size_t>(f)])].push_back(number++);
    }
  }
  for (std::size_t p = 0; p < faces_of.size(); ++p) {
    const std::vector<Index>& faces = faces_of[p];
    constexpr double kOnce = 0.5;  // between not at all and once
    is_nested[p] = !faces.empty() && winding_outside(faces.front()) > kOnce &&
                   winding_outside(faces[faces.size() / 2]) > kOnce && winding_outside(faces.back()) > kOnce;
  }
  return is_nested;
}

}  // namespace touchfield
