#include "sim/bem/element_integrals.h"

#include <Eigen/Geometry>

#include "sim/mesh/face_shape.h"

namespace touchfield {

double solid_angle(const Face& face, const Vector3& x) {
  return -solid_angle(Vector3(face.a - x), Vector3(face.b - x), Vector3(face.c - x));
}

Vector3 solid_angle_gradient(const Face& face, const Vector3& x) {
  const auto edge = [&](const Vector3& from, const Vector3& to) -> Vector3 {
    const Vector3 a = from - x;
    const Vector3 b = to - x;
    const double la = a.norm();
    const double lb = b.norm();
    return (la + lb) / (la * lb * (la * lb + a.dot(b))) * a.cross(b);
  };
  return -(edge(face.a, face.b) + edge(face.b, face.c) + edge(face.c, face.a));
}

}  // namespace touchfield
