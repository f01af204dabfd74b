#pragma once

#include <array>
#include <span>
#include <vector>

#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

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

}  // namespace touchfield
