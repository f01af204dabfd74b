#include "sim/bem/element_integrals.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/Geometry>

#include "sim/bem/triangle_rules.h"
#include "sim/mesh/face_shape.h"

namespace touchfield {

namespace {

/// What is integrated and how finely; the same for every piece of a face.
struct RemainderProblem {
  Vector3 x;
  Vector3 normal;
  Complex wavenumber;
  double smallest;  // pieces with shorter edges are not split further [m]
};

constexpr double kSplitRatio = 0.35;  // longest edge of a piece over its distance; tests hold it to 1e-6

Complex remainder_integral(const RemainderProblem& problem, const Vector3& a, const Vector3& b, const Vector3& c,
                           double area) {
  const double longest = std::sqrt(std::max({(b - a).squaredNorm(), (c - b).squaredNorm(), (a - c).squaredNorm()}));
  const double distance = (problem.x - (a + b + c) / 3.0).norm();
  if (longest > kSplitRatio * distance && longest > problem.smallest) {
    const Vector3 ab = 0.5 * (a + b);
    const Vector3 bc = 0.5 * (b + c);
    const Vector3 ca = 0.5 * (c + a);
    return remainder_integral(problem, a, ab, ca, 0.25 * area) + remainder_integral(problem, ab, b, bc, 0.25 * area) +
           remainder_integral(problem, ca, bc, c, 0.25 * area) + remainder_integral(problem, ab, bc, ca, 0.25 * area);
  }
  Complex sum = 0;
  for (const TrianglePoint& q : radon_rule()) {
    const Vector3 offset = problem.x - (a + q.u * (b - a) + q.v * (c - a));
    sum += q.weight * (double_layer_kernel(offset, problem.normal, problem.wavenumber) -
                       static_double_layer_kernel(offset, problem.normal));
  }
  return area * sum;
}

}  // namespace

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

Complex double_layer_integral(const Face& face, const Vector3& x, const Complex& wavenumber) {
  // Below this the remainder of a piece, about k^2 area / (8 pi), no longer matters whatever its shape.
  constexpr double kSmallestPerWavelength = 1e-3;
  const double wavelength = 2.0 * std::numbers::pi / wavenumber.real();
  const RemainderProblem problem{x, face.normal, wavenumber, kSmallestPerWavelength * wavelength};
  return solid_angle(face, x) / (4.0 * std::numbers::pi) +
         remainder_integral(problem, face.a, face.b, face.c, face.area);
}

}  // namespace touchfield
