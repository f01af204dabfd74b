#pragma once

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

}  // namespace touchfield
