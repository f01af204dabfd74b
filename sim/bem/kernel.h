#pragma once

#include <cmath>
#include <numbers>

#include "sim/core/types.h"

namespace touchfield {

/// Normal derivative of the free-space Green's function at its source,
///
///   dg/dn_y (x, y) = (1 - i k r) exp(i k r) n.(x - y) / (4 pi r^3),   g = exp(i k r) / (4 pi r), r = |x - y|
///
/// offset       x - y [m], not zero
/// normal       unit normal at y
/// wavenumber   k + i alpha [1/m]
/// returns      [1/m2]
inline Complex double_layer_kernel(const Vector3& offset, const Vector3& normal, const Complex& wavenumber) {
  const double r2 = offset.squaredNorm();
  const double r = std::sqrt(r2);
  const double kr = wavenumber.real() * r;
  const double ar = wavenumber.imag() * r;
  const double strength = normal.dot(offset) / (4.0 * std::numbers::pi * r2 * r) * std::exp(-ar);
  // (1 + ar - i kr) (cos kr + i sin kr)
  const double c = std::cos(kr);
  const double s = std::sin(kr);
  return {strength * ((1.0 + ar) * c + kr * s), strength * ((1.0 + ar) * s - kr * c)};
}

/// The same at k = 0: n.(x - y) / (4 pi r^3).
inline double static_double_layer_kernel(const Vector3& offset, const Vector3& normal) {
  const double r2 = offset.squaredNorm();
  return normal.dot(offset) / (4.0 * std::numbers::pi * r2 * std::sqrt(r2));
}

}  // namespace touchfield
