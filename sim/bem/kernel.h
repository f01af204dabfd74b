#pragma once

#include <cmath>
#include <numbers>

#include "sim/bem/sincos.h"
#include "sim/core/types.h"

namespace touchfield {

/// Normal derivative of the free-space Green's function at its source,
///
///   dg/dn_y (x, y) = (1 - i k r) exp(i k r) n.(x - y) / (4 pi r^3),   g = exp(i k r) / (4 pi r), r = |x - y|
///
/// r, along     distance [m], not zero, and n.(x - y) [m]
/// k, alpha     wavenumber k + i alpha [1/m]; damping = exp(-alpha r)
/// re, im       the value [1/m2]
inline void double_layer_kernel(double r, double along, double k, double alpha, double damping, double& re,
                                double& im) {
  const double kr = k * r;
  const SinCos wave = sincos(kr);
  const double strength = damping * along / (4.0 * std::numbers::pi * r * r * r);
  // (1 + alpha r - i k r) (cos kr + i sin kr)
  const double near = 1.0 + alpha * r;
  re = strength * (near * wave.cos + kr * wave.sin);
  im = strength * (near * wave.sin - kr * wave.cos);
}

/// The same from vectors: offset x - y [m], unit normal at y.
inline Complex double_layer_kernel(const Vector3& offset, const Vector3& normal, const Complex& wavenumber) {
  const double r = offset.norm();
  double re = 0;
  double im = 0;
  double_layer_kernel(r, normal.dot(offset), wavenumber.real(), wavenumber.imag(), std::exp(-wavenumber.imag() * r), re,
                      im);
  return {re, im};
}

/// The same at k = 0: n.(x - y) / (4 pi r^3).
inline double static_double_layer_kernel(const Vector3& offset, const Vector3& normal) {
  const double r2 = offset.squaredNorm();
  return normal.dot(offset) / (4.0 * std::numbers::pi * r2 * std::sqrt(r2));
}

}  // namespace touchfield
