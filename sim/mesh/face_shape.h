#pragma once

#include <cmath>

#include <Eigen/Geometry>

#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

/// Corners of a triangle as columns [m].
using Corners = Eigen::Matrix3d;

inline Corners corners(const TriangleMesh& mesh, Eigen::Index f) {
  Corners result;
  result << mesh.corner(f, 0), mesh.corner(f, 1), mesh.corner(f, 2);
  return result;
}

/// (b - a) x (c - a) of the face abc: along its normal, twice its area long [m2].
Vector3 twice_area_vector(const Points& points, const Eigen::Vector3i& face);

/// Whether a face has no area to speak of: below `least` of its longest edge squared. The default is TriangleMesh's
/// own limit: a face that is flat by it has no place in one.
bool is_flat(const Points& points, const Eigen::Vector3i& face, double least = 1e-12);

/// Angle between two vectors [rad], to all digits where it is small.
double angle_between(const Vector3& u, const Vector3& v);

/// The angle of a face at its corner c [rad].
double corner_angle(const TriangleMesh& mesh, Eigen::Index face, int c);

double smallest_angle(const Vector3& a, const Vector3& b, const Vector3& c);

/// The longest edge of a face [m].
double longest_edge(const TriangleMesh& mesh, Eigen::Index face);

/// Weights of a face's corners, >= 0 and 1 in sum, whose mean by them is the point x of the face.
Vector3 barycentric(const TriangleMesh& mesh, Eigen::Index face, const Vector3& x);

/// The point of triangle a, b, c that is nearest to x.
///
/// source   Ericson, Real-Time Collision Detection, 5.1.5
inline Vector3 nearest_on_triangle(const Vector3& a, const Vector3& b, const Vector3& c, const Vector3& x) {
  const Vector3 ab = b - a;
  const Vector3 ac = c - a;
  const double a1 = ab.dot(x - a);
  const double a2 = ac.dot(x - a);
  if (a1 <= 0 && a2 <= 0) {
    return a;
  }
  const double b1 = ab.dot(x - b);
  const double b2 = ac.dot(x - b);
  if (b1 >= 0 && b2 <= b1) {
    return b;
  }
  const double c1 = ab.dot(x - c);
  const double c2 = ac.dot(x - c);
  if (c2 >= 0 && c1 <= c2) {
    return c;
  }
  const double at_c = a1 * b2 - b1 * a2;
  if (at_c <= 0 && a1 >= 0 && b1 <= 0) {
    return a + a1 / (a1 - b1) * ab;
  }
  const double at_b = c1 * a2 - a1 * c2;
  if (at_b <= 0 && a2 >= 0 && c2 <= 0) {
    return a + a2 / (a2 - c2) * ac;
  }
  const double at_a = b1 * c2 - c1 * b2;
  if (at_a <= 0 && b2 >= b1 && c1 >= c2) {
    return b + (b2 - b1) / ((b2 - b1) + (c1 - c2)) * (c - b);
  }
  return a + (at_b * ab + at_c * ac) / (at_a + at_b + at_c);
}

/// Signed solid angle of a triangle [sr]; a, b, c relative to the eye. Positive if the triangle turns its back.
///
/// source   van Oosterom and Strackee, IEEE Trans. Biomed. Eng. 30 (1983) 125
inline double solid_angle(const Vector3& a, const Vector3& b, const Vector3& c) {
  const double la = a.norm();
  const double lb = b.norm();
  const double lc = c.norm();
  return 2.0 * std::atan2(a.dot(b.cross(c)), la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
}

}  // namespace touchfield
