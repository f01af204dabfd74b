#include "sim/mesh/triangle_mesh.h"

#include <algorithm>
#include <utility>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/core/require.h"

namespace touchfield {

namespace {

void require_finite(const Points& vertices) {
  Eigen::Index bad = 0;
  Eigen::Index first = -1;
  for (Eigen::Index v = 0; v < vertices.cols(); ++v) {
    if (!vertices.col(v).allFinite()) {
      first = bad++ == 0 ? v : first;
    }
  }
  require(bad == 0, "mesh: {} of {} vertices have a coordinate that is not a finite number, the first is vertex {}",
          bad, vertices.cols(), first);
}

}  // namespace

TriangleMesh::TriangleMesh(Points vertices, Triangles triangles)
    : vertices_(std::move(vertices)), triangles_(std::move(triangles)) {
  const Eigen::Index faces = triangles_.cols();
  require(faces != 0, "mesh: it has no triangle");
  require_finite(vertices_);
  for (Eigen::Index f = 0; f < faces; ++f) {
    require(triangles_.col(f).minCoeff() >= 0 && triangles_.col(f).maxCoeff() < vertices_.cols(),
            "mesh: face {} names a vertex outside 0..{}", f, vertices_.cols() - 1);
  }

  centroids_.resize(3, faces);
  normals_.resize(3, faces);
  areas_.resize(faces);
  constexpr double kDegenerate = 1e-12;  // area over longest edge squared; single-precision files stay above 1e-7
  Eigen::Index degenerate = 0;
  Eigen::Index first = -1;
  for (Eigen::Index f = 0; f < faces; ++f) {
    const Vector3 a = corner(f, 0);
    const Vector3 b = corner(f, 1);
    const Vector3 c = corner(f, 2);
    const Vector3 twice_area = (b - a).cross(c - a);
    const double longest = std::max({(b - a).squaredNorm(), (c - b).squaredNorm(), (a - c).squaredNorm()});
    areas_(f) = 0.5 * twice_area.norm();
    centroids_.col(f) = (a + b + c) / 3.0;
    normals_.col(f) = twice_area / (2.0 * areas_(f));
    if (!(areas_(f) > kDegenerate * longest)) {
      first = degenerate++ == 0 ? f : first;
    }
  }
  if (degenerate > 0) {
    const Vector3 at = centroids_.col(first) * 1e3;
    throw InputError(
        fmt::format("mesh: {} degenerate faces (no area), the first is face {} at ({:.2f}, {:.2f}, {:.2f}) mm",
                    degenerate, first, at.x(), at.y(), at.z()));
  }
}

double TriangleMesh::signed_volume() const {
  // About the mean vertex, so that a body far from the origin loses no digits.
  const Vector3 origin = vertices_.rowwise().mean();
  return (centroids_.colwise() - origin).cwiseProduct(normals_).colwise().sum().dot(areas_) / 3.0;
}

double TriangleMesh::mean_edge() const { return std::sqrt(areas_.mean() * 4.0 / std::sqrt(3.0)); }

TriangleMesh transformed(const TriangleMesh& mesh, const Eigen::Matrix3d& rotation, const Vector3& translation) {
  return {(rotation * mesh.vertices()).colwise() + translation, mesh.triangles()};
}

double edges_per_wavelength(const TriangleMesh& mesh, double wavelength) { return wavelength / mesh.mean_edge(); }

}  // namespace touchfield
