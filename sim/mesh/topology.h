#pragma once

#include <algorithm>
#include <array>
#include <span>
#include <vector>

#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

/// Side `corner` of a face, from that corner to the next; low < high are its vertices.
struct Side {
  int low;
  int high;
  Eigen::Index face;
  int corner;
  bool upwards;  // runs from low to high

  int number() const { return static_cast<int>(3 * face) + corner; }
  bool same_edge(const Side& other) const { return low == other.low && high == other.high; }
};

/// The sides of all faces, those of one edge next to each other, the lower face first.
///
/// triangles   3 x M, each of three distinct vertices
std::vector<Side> sorted_sides(const Triangles& triangles);

/// Calls visit(std::span<const Side>) with the sides of each edge.
template <class Visit>
void for_each_edge(const std::vector<Side>& sides, const Visit& visit) {
  for (std::size_t first = 0; first < sides.size();) {
    std::size_t last = first + 1;
    while (last < sides.size() && sides[last].same_edge(sides[first])) {
      ++last;
    }
    visit(std::span<const Side>(sides).subspan(first, last - first));
    first = last;
  }
}

/// The edges of a mesh, numbered in the order of their lower, then higher vertex.
struct EdgeTable {
  Eigen::Matrix2Xi ends;  // 2 x E vertex indices, the lower first
  Triangles of_face;      // 3 x M: the edge between corners c and c + 1 (mod 3) of each face
};

EdgeTable edge_table(const Triangles& triangles);

/// Disjoint sets of 0..n-1.
class DisjointSets {
 public:
  explicit DisjointSets(Eigen::Index n);

  Eigen::Index root(Eigen::Index i);
  void join(Eigen::Index a, Eigen::Index b) { parent_[static_cast<std::size_t>(root(b))] = root(a); }

  /// The number of its set for each element, from 0 in the order of the sets' first elements; and how many sets.
  std::vector<int> numbered(int& count);

 private:
  std::vector<Eigen::Index> parent_;
};

/// The fans of faces round the vertices: corners (3 face + corner) of one vertex are in one set if their faces follow
/// each other across edges. A vertex is a manifold point if its corners form one set.
DisjointSets fans(const Triangles& triangles, const std::vector<Side>& sides);

/// A list of points or of faces as the columns of a matrix, without a copy.
inline Eigen::Map<const Points> as_columns(const std::vector<Vector3>& list) {
  return {reinterpret_cast<const double*>(list.data()), 3, static_cast<Eigen::Index>(list.size())};
}
inline Eigen::Map<const Triangles> as_columns(const std::vector<std::array<int, 3>>& list) {
  return {reinterpret_cast<const int*>(list.data()), 3, static_cast<Eigen::Index>(list.size())};
}

/// The points of a matrix as a list, to which others can be added.
std::vector<Vector3> as_list(const Points& points);

/// The faces f of which keep(f) holds, in their order.
template <class Keep>
Triangles faces_where(const Triangles& triangles, const Keep& keep) {
  std::vector<Eigen::Index> kept;
  for (Eigen::Index f = 0; f < triangles.cols(); ++f) {
    if (keep(f)) {
      kept.push_back(f);
    }
  }
  return triangles(Eigen::all, kept);
}

/// Leaves out the points that no face names; the others keep their order.
void drop_unused_points(Points& points, Triangles& triangles);

/// The faces round each vertex, in their order.
class FacesRound {
 public:
  FacesRound(const Triangles& triangles, Eigen::Index vertex_count);

  std::span<const Eigen::Index> of(int vertex) const {
    const auto v = static_cast<std::size_t>(vertex);
    return std::span(faces_).subspan(starts_[v], starts_[v + 1] - starts_[v]);
  }

 private:
  std::vector<std::size_t> starts_;  // faces of vertex v: faces_[k], starts_[v] <= k < starts_[v + 1]
  std::vector<Eigen::Index> faces_;
};

/// Cosine of 60 degrees. Faces with normals farther apart do not belong to one side of the skin. Such a face is on the
/// far side of a thin part or beyond a sharp edge.
inline constexpr double kSameSide = 0.5;

/// Adds the faces that share a vertex with one in the list and look within 60 degrees of a unit normal.
inline void add_ring(const TriangleMesh& mesh, const FacesRound& round, const Vector3& normal,
                     std::vector<Eigen::Index>& faces) {
  const std::size_t inner = faces.size();
  for (std::size_t i = 0; i < inner; ++i) {
    for (int c = 0; c < 3; ++c) {
      for (const Eigen::Index f : round.of(mesh.triangles()(c, faces[i]))) {
        if (mesh.normals().col(f).dot(normal) >= kSameSide && std::find(faces.begin(), faces.end(), f) == faces.end()) {
          faces.push_back(f);
        }
      }
    }
  }
}

/// Every flat face split in four by the middles of its edges. The surface stays the same set of points; faces that
/// shared an edge share its middle, so that a closed manifold stays one. The first vertices are the mesh's own.
///
/// Face f becomes faces 4f, 4f + 1, 4f + 2 at its corners 0, 1, 2, and 4f + 3 in its middle: the centroid of 4f + 3 is
/// that of f, where values on the two meshes can be compared.
TriangleMesh split_faces(const TriangleMesh& mesh);

}  // namespace touchfield
