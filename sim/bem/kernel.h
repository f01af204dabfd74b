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

}  // namespace touchfield
