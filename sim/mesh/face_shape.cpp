#include "sim/mesh/face_shape.h"

#include <algorithm>

namespace touchfield {

Vector3 twice_area_vector(const Points& points, const Eigen::Vector3i& face) {
  const Vector3 a = points.col(face(0));
  return (points.col(face(1)) - a).cross(points.col(face(2)) - a);
}

bool is_flat(const Points& points, const Eigen::Vector3i& face, double least) {
  double longest = 0;
  for (int c = 0; c < 3; ++c) {
    longest = std::max(longest, (points.col(face((c + 1) % 3)) - points.col(face(c))).squaredNorm());
  }
  return !(0.5 * twice_area_vector(points, face).norm() > least * longest);
}

// By the arc tangent, for the arc cosine loses the digits of small angles.
double angle_between(const Vector3& u, const Vector3& v) { return std::atan2(u.cross(v).norm(), u.dot(v)); }

double corner_angle(const TriangleMesh& mesh, Eigen::Index face, int c) {
  const Vector3 x = mesh.corner(face, c);
  return angle_between(mesh.corner(face, (c + 1) % 3) - x, mesh.corner(face, (c + 2) % 3) - x);
}

double smallest_angle(const Vector3& a, const Vector3& b, const Vector3& c) {
  const double area = (b - a).cross(c - a).norm();
  const auto angle = [&](const Vector3& at, const Vector3& one, const Vector3& other) {
    return std::atan2(area, (one - at).dot(other - at));
  };
  return std::min({angle(a, b, c), angle(b, c, a), angle(c, a, b)});
}

double longest_edge(const TriangleMesh& mesh, Eigen::Index face) {
  double longest = 0;
  for (int c = 0; c < 3; ++c) {
    longest = std::max(longest, (mesh.corner(face, (c + 1) % 3) - mesh.corner(face, c)).norm());
  }
  return longest;
}

Vector3 barycentric(const TriangleMesh& mesh, Eigen::Index face, const Vector3& x) {
  Vector3 weights;
  for (int c = 0; c < 3; ++c) {
    const Vector3 b = mesh.corner(face, (c + 1) % 3);
    weights(c) = std::max(0.0, (mesh.corner(face, (c + 2) % 3) - b).dot(mesh.normals().col(face).cross(b - x)));
  }
  return weights / weights.sum();
}

}  // namespace touchfield
