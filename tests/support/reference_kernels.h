#pragma once

#include <cmath>
#include <numbers>

#include "sim/bem/pair_loops.h"
#include "sim/core/types.h"

namespace touchfield {

/// The four kernels of a pair of points as the textbook has them.
struct ReferenceKernels {
  Complex single;         // S   g = exp(i k r) / (4 pi r)
  Complex dual;           // D   dg/dn_y
  Complex adjoint;        // D'  dg/dn_x
  Complex hypersingular;  // W   d2g/dn_x dn_y
};

/// D at k = 0: n.(x - y) / (4 pi r^3).
inline double static_double_layer_kernel(const Vector3& offset, const Vector3& normal) {
  const double r2 = offset.squaredNorm();
  return normal.dot(offset) / (4.0 * std::numbers::pi * r2 * std::sqrt(r2));
}

/// x, m   test point and its normal;  y, n   source and its normal
inline ReferenceKernels reference_kernels(const Vector3& x, const Vector3& m, const Vector3& y, const Vector3& n,
                                          const Complex& wavenumber) {
  const Vector3 d = x - y;
  const double r = d.norm();
  const Complex ikr = Complex(0, 1) * wavenumber * r;
  const Complex g = std::exp(ikr) / (4.0 * std::numbers::pi * r);
  const Complex first = (1.0 - ikr) * g / (r * r);                     // -g'(r) / r
  const Complex second = (3.0 - 3.0 * ikr + ikr * ikr) * g / (r * r);  // r (g'(r) / r)'
  return {g, first * n.dot(d), -first * m.dot(d), first * m.dot(n) - second * m.dot(d) * n.dot(d) / (r * r)};
}

/// One of Layer's sums of them, eta = i gamma.
inline Complex reference_value(Layer layer, const ReferenceKernels& kernels, double gamma) {
  const Complex eta(0, gamma);
  switch (layer) {
    case Layer::kSingle:
      return kernels.single;
    case Layer::kDouble:
      return kernels.dual;
    case Layer::kAdjoint:
      return kernels.adjoint;
    case Layer::kBurtonMiller:
      return kernels.dual + eta * kernels.hypersingular;
    case Layer::kAdjointMiller:
      return kernels.adjoint + eta * kernels.hypersingular;
    case Layer::kSingleAdjoint:
      return kernels.single + eta * kernels.adjoint;
  }
  return {};
}

}  // namespace touchfield
