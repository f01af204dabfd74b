#include "sim/mesh/face_shape.h"

#include <algorithm>

#include <Eigen/Geometry>

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

}  // namespace touchfield
