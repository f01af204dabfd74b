#include "sim/mesh/remesh/mean_height.h"

#include <algorithm>

namespace touchfield {

VertexMeans::VertexMeans(const TriangleMesh& mesh)
    : normals(Points::Zero(3, mesh.vertex_count())), areas(Eigen::VectorXd::Zero(mesh.vertex_count())) {
  for (Eigen::Index f = 0; f < mesh.face_count(); ++f) {
    for (const int v : mesh.triangles().col(f)) {
      normals.col(v) += mesh.areas()(f) * mesh.normals().col(f);
      areas(v) += mesh.areas()(f);
    }
  }
  normals.colwise().normalize();
}

TriangleMesh with_mean_height_zero(const TriangleMesh& mesh, const Eigen::VectorXd& heights,
                                   const Eigen::VectorXd& most) {
  const VertexMeans means(mesh);
  Eigen::VectorXd lift = Eigen::VectorXd::Zero(mesh.vertex_count());
  for (Eigen::Index f = 0; f < mesh.face_count(); ++f) {
    for (const int v : mesh.triangles().col(f)) {
      lift(v) += mesh.areas()(f) * heights(f);
    }
  }
  Points vertices = mesh.vertices();
  for (Eigen::Index v = 0; v < vertices.cols(); ++v) {
    vertices.col(v) += std::clamp(lift(v) / means.areas(v), -most(v), most(v)) * means.normals.col(v);
  }
  return {vertices, mesh.triangles()};
}

}  // namespace touchfield
