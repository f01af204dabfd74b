#include "sim/mesh/topology.h"

#include <numeric>
#include <tuple>

namespace touchfield {

namespace {

using Index = Eigen::Index;

/// Corner of `face` at `vertex`, numbered 3 face + corner.
Index corner_at(const Triangles& triangles, Index face, int vertex) {
  int c = 0;
  while (triangles(c, face) != vertex) {
    ++c;
  }
  return 3 * face + c;
}

}  // namespace

std::vector<Side> sorted_sides(const Triangles& triangles) {
  std::vector<Side> sides;
  sides.reserve(static_cast<std::size_t>(3 * triangles.cols()));
  for (Index f = 0; f < triangles.cols(); ++f) {
    for (int c = 0; c < 3; ++c) {
      const int a = triangles(c, f);
      const int b = triangles((c + 1) % 3, f);
      sides.push_back({std::min(a, b), std::max(a, b), f, c, a < b});
    }
  }
  std::sort(sides.begin(), sides.end(), [](const Side& s, const Side& t) {
    return std::tie(s.low, s.high, s.face, s.corner) < std::tie(t.low, t.high, t.face, t.corner);
  });
  return sides;
}

EdgeTable edge_table(const Triangles& triangles) {
  EdgeTable table{Eigen::Matrix2Xi(2, triangles.size()), Triangles(3, triangles.cols())};
  int count = 0;
  for_each_edge(sorted_sides(triangles), [&](std::span<const Side> edge) {
    table.ends.col(count) << edge[0].low, edge[0].high;
    for (const Side& side : edge) {
      table.of_face(side.corner, side.face) = count;
    }
    ++count;
  });
  table.ends.conservativeResize(2, count);
  return table;
}

DisjointSets::DisjointSets(Index n) : parent_(static_cast<std::size_t>(n)) {
  std::iota(parent_.begin(), parent_.end(), 0);
}

Index DisjointSets::root(Index i) {
  while (parent_[static_cast<std::size_t>(i)] != i) {
    auto& parent = parent_[static_cast<std::size_t>(i)];
    parent = parent_[static_cast<std::size_t>(parent)];
    i = parent;
  }
  return i;
}

std::vector<int> DisjointSets::numbered(int& count) {
  std::vector<int> number_of_root(parent_.size(), -1);
  std::vector<int> numbers(parent_.size());
  count = 0;
  for (std::size_t i = 0; i < parent_.size(); ++i) {
    int& number = number_of_root[static_cast<std::size_t>(root(static_cast<Index>(i)))];
    if (number < 0) {
      number = count++;
    }
    numbers[i] = number;
  }
  return numbers;
}

DisjointSets fans(const Triangles& triangles, const std::vector<Side>& sides) {
  DisjointSets corners(3 * triangles.cols());
  for_each_edge(sides, [&](std::span<const Side> edge) {
    for (const Side& other : edge.subspan(1)) {
      for (const int vertex : {edge[0].low, edge[0].high}) {
        corners.join(corner_at(triangles, edge[0].face, vertex), corner_at(triangles, other.face, vertex));
      }
    }
  });
  return corners;
}

std::vector<Vector3> as_list(const Points& points) {
  const auto columns = points.colwise();
  return {columns.begin(), columns.end()};
}

void drop_unused_points(Points& points, Triangles& triangles) {
  std::vector<int> number(static_cast<std::size_t>(points.cols()), -1);
  for (const int v : triangles.reshaped()) {
    number[static_cast<std::size_t>(v)] = 0;
  }
  int count = 0;
  for (Eigen::Index v = 0; v < points.cols(); ++v) {
    if (int& n = number[static_cast<std::size_t>(v)]; n == 0) {
      points.col(count) = points.col(v).eval();
      n = count++;
    }
  }
  points.conservativeResize(3, count);
  for (int& v : triangles.reshaped()) {
    v = number[static_cast<std::size_t>(v)];
  }
}

FacesRound::FacesRound(const Triangles& triangles, Eigen::Index vertex_count)
    : starts_(static_cast<std::size_t>(vertex_count) + 1, 0), faces_(static_cast<std::size_t>(triangles.size())) {
  for (const int v : triangles.reshaped()) {
    ++starts_[static_cast<std::size_t>(v) + 1];
  }
  std::partial_sum(starts_.begin(), starts_.end(), starts_.begin());
  std::vector<std::size_t> next(starts_.begin(), starts_.end() - 1);
  for (Eigen::Index corner = 0; corner < triangles.size(); ++corner) {
    faces_[next[static_cast<std::size_t>(triangles(corner % 3, corner / 3))]++] = corner / 3;
  }
}

TriangleMesh split_faces(const TriangleMesh& mesh) {
  const EdgeTable edges = edge_table(mesh.triangles());
  const Eigen::Index own = mesh.vertex_count();
  Points vertices(3, own + edges.ends.cols());
  vertices.leftCols(own) = mesh.vertices();
  for (Eigen::Index e = 0; e < edges.ends.cols(); ++e) {
    vertices.col(own + e) = 0.5 * (mesh.vertices().col(edges.ends(0, e)) + mesh.vertices().col(edges.ends(1, e)));
  }

  Triangles triangles(3, 4 * mesh.face_count());
  for (Eigen::Index f = 0; f < mesh.face_count(); ++f) {
    const Eigen::Vector3i corner = mesh.triangles().col(f);
    const Eigen::Vector3i middle = edges.of_face.col(f).array() + static_cast<int>(own);
    triangles.col(4 * f) << corner(0), middle(0), middle(2);
    triangles.col(4 * f + 1) << middle(0), corner(1), middle(1);
    triangles.col(4 * f + 2) << middle(2), middle(1), corner(2);
    triangles.col(4 * f + 3) = middle;
  }
  return {vertices, triangles};
}

}  // namespace touchfield
