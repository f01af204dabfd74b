#include "sim/mesh/query/pieces.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <utility>

#include <Eigen/Geometry>

#include "sim/mesh/face_shape.h"
#include "sim/mesh/query/box_tree.h"
#include "sim/mesh/query/face_tree.h"
#include "sim/mesh/query/self_intersections.h"

namespace touchfield {

namespace {

using Index = Eigen::Index;

/// The faces that have an area, those of pieces of negative volume turned round, so that every piece looks outwards.
///
/// piece_of   set to the piece of each face of the result
TriangleMesh outward_mesh(const Points& points, const Triangles& triangles, const Pieces& pieces,
                          std::vector<std::size_t>& piece_of) {
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
    piece_of.push_back(static_cast<std::size_t>(piece));
    ++count;
  }
  outward.conservativeResize(3, count);
  return {points, std::move(outward)};
}

std::vector<Box> boxes_round(const Points& points, const Triangles& triangles, const Pieces& pieces) {
  std::vector<Box> boxes(pieces.list.size());
  for (Index f = 0; f < triangles.cols(); ++f) {
    for (const int v : triangles.col(f)) {
      boxes[static_cast<std::size_t>(pieces.of_face[static_cast<std::size_t>(f)])].extend(Vector3(points.col(v)));
    }
  }
  return boxes;
}

TriangleMesh part(const TriangleMesh& mesh, const std::vector<Index>& faces) {
  return {mesh.vertices(), mesh.triangles()(Eigen::all, faces)};
}

/// Those of the pieces `within` another one's box that lie inside it.
///
/// mesh   every piece looks outwards
std::vector<std::size_t> inside(const TriangleMesh& mesh, const std::vector<std::vector<Index>>& faces_of,
                                const std::vector<std::size_t>& piece_of, std::size_t outer,
                                std::vector<std::size_t> within) {
  const TriangleMesh shell = part(mesh, faces_of[outer]);
  const FaceTree tree(shell);
  std::erase_if(within, [&](std::size_t inner) {
    return !std::ranges::all_of(faces_of[inner], [&](Index f) {
      constexpr double kLift = 1e-3;  // of the face's size: just outside the inner piece
      constexpr double kOnce = 0.5;   // between not at all and once
      const Vector3 lift = kLift * std::sqrt(mesh.areas()(f)) * mesh.normals().col(f);
      return tree.winding_number(mesh.centroids().col(f) + lift) > kOnce;
    });
  });
  // A face may reach out of the shell though its centroid is inside.
  std::vector<Index> faces;
  for (const std::size_t inner : within) {
    faces.insert(faces.end(), faces_of[inner].begin(), faces_of[inner].end());
  }
  if (faces.empty()) {
    return within;
  }
  std::set<std::size_t> cutting;
  for (const auto& [f, g] : intersections(part(mesh, faces), shell, std::numeric_limits<std::size_t>::max())) {
    cutting.insert(piece_of[static_cast<std::size_t>(faces[static_cast<std::size_t>(f)])]);
  }
  std::erase_if(within, [&](std::size_t inner) { return cutting.contains(inner); });
  return within;
}

}  // namespace

bool Piece::flat() const {
  constexpr double kFlat = 1e-9;  // volume over area^1.5, 0.094 for a sphere: rounding leaves 1e-16 times the distance
  return std::abs(volume) <= kFlat * std::pow(area, 1.5);
}

Pieces find_pieces(const Points& points, const Triangles& triangles, const std::vector<Side>& sides, std::size_t most) {
  DisjointSets faces(triangles.cols());
  for_each_edge(sides, [&](std::span<const Side> edge) {
    for (const Side& other : edge.subspan(edge.size() > most ? edge.size() : 1)) {
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
  std::vector<std::size_t> piece_of;
  const TriangleMesh mesh = outward_mesh(points, triangles, pieces, piece_of);
  std::vector<std::vector<Index>> faces_of(pieces.list.size());
  for (Index f = 0; f < mesh.face_count(); ++f) {
    faces_of[piece_of[static_cast<std::size_t>(f)]].push_back(f);
  }
  const std::vector<Box> boxes = boxes_round(points, triangles, pieces);
  const BoxTree near(boxes);
  for (std::size_t outer = 0; outer < faces_of.size(); ++outer) {
    std::vector<std::size_t> within;
    near.for_each_meeting(boxes[outer], [&](Index piece) {
      const auto inner = static_cast<std::size_t>(piece);
      if (inner != outer && !is_nested[inner] && !faces_of[inner].empty() && boxes[outer].contains(boxes[inner])) {
        within.push_back(inner);
      }
    });
    if (!within.empty() && !faces_of[outer].empty()) {
      for (const std::size_t inner : inside(mesh, faces_of, piece_of, outer, within)) {
        is_nested[inner] = true;
      }
    }
  }
  return is_nested;
}

}  // namespace touchfield
