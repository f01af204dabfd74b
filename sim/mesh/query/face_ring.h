#pragma once

#include <algorithm>
#include <vector>

#include "sim/mesh/subset.h"
#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

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

}  // namespace touchfield
