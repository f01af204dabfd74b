#include "sim/mesh/remesh/subdivide.h"

#include "sim/mesh/topology.h"

namespace touchfield {

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
