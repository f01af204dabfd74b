#pragma once

#include <array>
#include <cmath>

namespace touchfield {

/// A point of a rule on a triangle.
struct TrianglePoint {
  double weight;  // of the triangle's area
  double u;
  double v;  // barycentric coordinates of corners b and c
};

/// Radon's 7-point rule, exact for polynomials of degree 5.
inline const std::array<TrianglePoint, 7>& radon_rule() {
  static const std::array<TrianglePoint, 7> rule = [] {
    const double root = std::sqrt(15.0);
    const double w1 = (155.0 - root) / 1200.0;
    const double w2 = (155.0 + root) / 1200.0;
    const double s1 = (6.0 - root) / 21.0;
    const double s2 = (6.0 + root) / 21.0;
    return std::array<TrianglePoint, 7>{{{9.0 / 40.0, 1.0 / 3.0, 1.0 / 3.0},
                                         {w1, s1, s1},
                                         {w1, 1.0 - 2.0 * s1, s1},
                                         {w1, s1, 1.0 - 2.0 * s1},
                                         {w2, s2, s2},
                                         {w2, 1.0 - 2.0 * s2, s2},
                                         {w2, s2, 1.0 - 2.0 * s2}}};
  }();
  return rule;
}

/// Strang and Fix's 3-point rule with inner points, exact for degree 2.
inline const std::array<TrianglePoint, 3>& strang_rule() {
  static const std::array<TrianglePoint, 3> rule = {
      {{1.0 / 3.0, 1.0 / 6.0, 1.0 / 6.0}, {1.0 / 3.0, 2.0 / 3.0, 1.0 / 6.0}, {1.0 / 3.0, 1.0 / 6.0, 2.0 / 3.0}}};
  return rule;
}

}  // namespace touchfield
