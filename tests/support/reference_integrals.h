#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include <Eigen/Geometry>

#include "sim/bem/quadrature.h"

namespace touchfield {

inline Face make_face(const Vector3& a, const Vector3& b, const Vector3& c) {
  const Vector3 twice = (b - a).cross(c - a);
  return {a, b, c, twice.normalized(), 0.5 * twice.norm()};
}

/// Tanh-sinh nodes and weights on 0..1: converges past the near-singular spikes that defeat polynomial rules.
struct TanhSinh {
  std::vector<double> x;
  std::vector<double> w;

  TanhSinh() {
    constexpr double kStep = 1.0 / 20.0;
    for (int i = -69; i <= 69; ++i) {
      const double t = i * kStep;
      const double u = 0.5 * std::numbers::pi * std::sinh(t);
      x.push_back(1.0 / (1.0 + std::exp(-2.0 * u)));  // keeps its digits near 0, where the spike sits
      w.push_back(0.25 * kStep * std::numbers::pi * std::cosh(t) / (std::cosh(u) * std::cosh(u)));
    }
  }
};

/// Point of the segment from a to b nearest to x.
inline Vector3 nearest_on_segment(const Vector3& a, const Vector3& b, const Vector3& x) {
  return a + std::clamp((b - a).dot(x - a) / (b - a).squaredNorm(), 0.0, 1.0) * (b - a);
}

inline Vector3 nearest_on_face(const Face& face, const Vector3& x) {
  const std::array<Vector3, 3> corners = {face.a, face.b, face.c};
  const Vector3 foot = x - face.normal.dot(x - face.a) * face.normal;
  bool within = true;
  Vector3 nearest = face.a;
  for (std::size_t e = 0; e < 3; ++e) {
    const Vector3& b = corners[e];
    const Vector3& c = corners[(e + 1) % 3];
    within = within && face.normal.dot((c - b).cross(foot - b)) >= 0;
    const Vector3 candidate = nearest_on_segment(b, c, x);
    nearest = (candidate - x).norm() < (nearest - x).norm() ? candidate : nearest;
  }
  return within ? foot : nearest;
}

/// Integral of kernel(y) over a face, the kernel smooth but for a spike or a 1/r at x, by tanh-sinh in both directions
/// on triangles that have their corner at the point nearest to x and right angles at the edges: whatever is nearly
/// singular sits at the end of a range. About 1e-12 relative to the integral of the kernel's magnitude.
template <typename Kernel>
auto reference_integral(const Face& face, const Vector3& x, const Kernel& kernel) {
  static const TanhSinh rule;
  const Vector3 apex = nearest_on_face(face, x);
  const std::array<Vector3, 3> corners = {face.a, face.b, face.c};
  decltype(kernel(apex)) sum = kernel(corners[0]) * 0.0;
  const auto add = [&](const Vector3& b, const Vector3& c) {
    const double twice_area = face.normal.dot((b - apex).cross(c - apex));
    if (twice_area < 1e-12 * face.area) {
      return;
    }
    for (std::size_t i = 0; i < rule.x.size(); ++i) {
      for (std::size_t j = 0; j < rule.x.size(); ++j) {
        const Vector3 y = apex + rule.x[i] * ((b - apex) + rule.x[j] * (c - b));
        if ((x - y).norm() > 0) {
          sum = sum + kernel(y) * (rule.w[i] * rule.w[j] * rule.x[i] * twice_area);
        }
      }
    }
  };
  for (std::size_t e = 0; e < 3; ++e) {
    const Vector3& b = corners[e];
    const Vector3& c = corners[(e + 1) % 3];
    const Vector3 foot = nearest_on_segment(b, c, apex);
    // The spike sits at the start of each range of j as well.
    add(b, foot);
    add(foot, c);
  }
  return sum;
}

}  // namespace touchfield
