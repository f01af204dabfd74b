#pragma once

#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

/// The meshes side by side, nothing merged.
inline TriangleMesh together(const TriangleMesh& one, const TriangleMesh& other) {
  Points vertices(3, one.vertex_count() + other.vertex_count());
  vertices << one.vertices(), other.vertices();
  Triangles triangles(3, one.face_count() + other.face_count());
  triangles << one.triangles(), (other.triangles().array() + static_cast<int>(one.vertex_count())).matrix();
  return {vertices, triangles};
}

inline TriangleMesh shifted(const TriangleMesh& mesh, const Vector3& by) {
  return transformed(mesh, Eigen::Matrix3d::Identity(), by);
}

}  // namespace touchfield
