#pragma once

#include <cmath>
#include <numbers>

#include "sim/core/sincos.h"
#include "sim/core/types.h"

namespace touchfield {

/// Normal derivative of the free-space Green's function at its source,
///
///   dg/dn_y (x, y) = (1 - i k r) exp(i k r) n.(x - y) / (4 pi r^3),   g = exp(i k r) / (4 pi r), r = |x - y|
///
/// offset       x - y [m], not zero
/// normal       n, the unit normal at y
/// wavenumber   k + i alpha [1/m]
/// returns      the value [1/m2]
inline Complex double_layer_kernel(const Vector3& offset, const Vector3& normal, const Complex& wavenumber) {
  const double r = offset.norm();
  const double kr = wavenumber.real() * r;
  const SinCos wave = sincos(kr);
  const double damping = std::exp(-wavenumber.imag() * r);
  const double strength = damping * normal.dot(offset) / (4.0 * std::numbers::pi * r * r * r);
  // (1 + alpha r - i k r) (cos kr + i sin kr)
  const double near = 1.0 + wavenumber.imag() * r;
  return {strength * (near * wave.cos + kr * wave.sin), strength * (near * wave.sin - kr * wave.cos)};
}

/// The same at k = 0: n.(x - y) / (4 pi r^3).
inline double static_double_layer_kernel(const Vector3& offset, const Vector3& normal) {
  const double r2 = offset.squaredNorm();
  return normal.dot(offset) / (4.0 * std::numbers::pi * r2 * std::sqrt(r2));
}

/// A flat triangle with its geometry.
struct Face {
  Vector3 a;
  Vector3 b;
  Vector3 c;       // corners [m], counter-clockwise seen from the normal's side
  Vector3 normal;  // unit
  double area;     // [m2]
};

/// Signed solid angle of a flat triangle seen from x [sr], positive on the side the normal points to; exact. On the
/// triangle's plane inside its edges it is +-2 pi by the sign of rounding. By that of face_shape.h.
double solid_angle(const Face& face, const Vector3& x);

/// Gradient of the solid angle in x [sr/m], by the loop round the triangle's edges; exact, infinite on an edge.
///
///   grad Omega = loop (x - y) x dy / |x - y|^3
Vector3 solid_angle_gradient(const Face& face, const Vector3& x);

}  // namespace touchfield
