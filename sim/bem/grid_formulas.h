#pragma once

#include "sim/bem/grid_loops.h"
#include "sim/bem/pair_formulas.h"

namespace touchfield::TOUCHFIELD_LEVEL {

/// The local kernel of a pair of points (LocalKernel), of one instruction level or of the graphics card. Lengths are in
/// units of its reach.

template <typename Real>
TOUCHFIELD_EVERYWHERE inline Real polynomial(const Real* c, Real t) {
  Real sum = c[kLocalDegree<Real>];
#ifndef __CUDACC__
#pragma GCC unroll 32
#endif
  for (int i = kLocalDegree<Real> - 1; i >= 0; --i) {
    sum = sum * t + c[i];
  }
  return sum;
}

template <Layer kLayer>
constexpr bool kCharge = kLayer == Layer::kSingle || kLayer == Layer::kSingleAdjoint;
template <Layer kLayer>
constexpr bool kMiller = kLayer == Layer::kBurtonMiller || kLayer == Layer::kAdjointMiller;

/// What a layer's kernel is with one part, real or imaginary, of the local kernel: value, and what i gamma goes with.
template <Layer kLayer, typename Real>
TOUCHFIELD_EVERYWHERE inline void local_part(const typename LocalKernel<Real>::Part& part, Real t, Real reciprocal,
                                             Real nd, Real md, Real mn, Real& value, Real& slope) {
  const Real cube = reciprocal * reciprocal * reciprocal;
  const Real a = kLayer == Layer::kSingle ? Real(0) : polynomial(part.a, t) * cube;
  value = 0;
  slope = 0;
  if constexpr (kCharge<kLayer>) {
    value = polynomial(part.v, t) * reciprocal;
    slope = -a * md;
  } else {
    value = kLayer == Layer::kDouble || kLayer == Layer::kBurtonMiller ? a * nd : -a * md;
  }
  if constexpr (kMiller<kLayer>) {
    const Real b = polynomial(part.b, t) * cube;
    slope = a * mn - b * (reciprocal * reciprocal) * md * nd;
  }
}

/// The kernel of a pair, times 4 pi; 0 beyond the reach.
///
/// r2, root     r^2 and 1/r (finite) of d = x - y
/// nd, md, mn   n.d, m.d and m.n, m the normal at x and n at y
template <Layer kLayer, bool kDamped, typename Real>
TOUCHFIELD_EVERYWHERE inline void local_kernel(const LocalKernel<Real>& k, Real r2, Real root, Real nd, Real md,
                                               Real mn, Real& re, Real& im) {
  const Real reciprocal = r2 > Real(0) && r2 < Real(1) ? root : Real(0);
  const Real touch = r2 > Real(0) ? Real(0) : Real(1);
  const Real t = 2 * (r2 * reciprocal) - 1;
  Real value;
  Real slope;
  local_part<kLayer, Real>(k.re, t, reciprocal, nd, md, mn, value, slope);
  re = value;
  im = k.gamma * slope;
  if constexpr (kDamped) {
    Real damped_value;
    Real damped_slope;
    local_part<kLayer, Real>(k.im, t, reciprocal, nd, md, mn, damped_value, damped_slope);
    re -= k.gamma * damped_slope;
    im += damped_value;
  }
  if constexpr (kCharge<kLayer>) {
    re += touch * k.re.s0;
    im += touch * k.im.s0;
  }
  if constexpr (kMiller<kLayer>) {
    const Real along = touch * k.gamma * mn;
    re -= along * k.im.w0;
    im += along * k.re.w0;
  }
}

}  // namespace touchfield::TOUCHFIELD_LEVEL
