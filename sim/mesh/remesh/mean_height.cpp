#include "sim/mesh/remesh/mean_height.h"

#include <algorithm>

namespace touchfield {

TriangleMesh with_mean_height_zero(const TriangleMesh& mesh, const Eigen::VectorXd& heights,
                                   const Eigen::VectorXd& most) {
  Eigen::VectorXd lift = Eigen::VectorXd::Zero(mesh.vertex_count());
  Eigen::VectorXd weight = Eigen::VectorXd::Zero(mesh.vertex_count());
  Points normal = Points::Zero(3, mesh.vertex_count());
  for (Eigen::Index f = 0; f < mesh.face_count(); ++f) {
    const double area = mesh.areas()(f);
    for (int c = 0; c < 3; ++c) {
      const int v = mesh.triangles()(c, f);
      lift(v) += area * heights(f);
      weight(v) += area;
      normal.col(v) += area * mesh.normals().col(f);
    }
  }
  Points vertices = mesh.vertices();
  for (Eigen::Index v = 0; v < vertices.cols(); ++v) {
    vertices.col(v) += std::clamp(lift(v) / weight(v), -most(v), most(v)) * normal.col(v).normalized();
  }
  return {vertices, mesh.triangles()};
}

}  // namespace touchfield
