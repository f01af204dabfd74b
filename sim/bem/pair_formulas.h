#pragma once

#include <cmath>
#include <type_traits>

#include "sim/bem/everywhere.h"
#include "sim/bem/pair_loops.h"

namespace touchfield::TOUCHFIELD_LEVEL {

/// The kernels of a pair of points, of one instruction level or of the graphics card. Lengths are in half wavelengths,
/// so that k r = pi u.

/// sin(pi f) and cos(pi f) without a call or a branch, so that loops over it become SIMD code.
///
/// f          |f| <= 1/2
/// accuracy   absolute error below 1.5e-8 (float), 1e-16 (double), plus rounding
/// method     polynomials in f^2, interpolated at Chebyshev nodes in exact arithmetic
template <typename Real>
TOUCHFIELD_EVERYWHERE inline void half_cycle_sincos(Real f, Real& sine, Real& cosine) {
  const Real t = f * f;
  Real s;
  Real c;
  if constexpr (std::is_same_v<Real, float>) {
    s = 3.14159264007720F +
        t * (-5.16771007667F + t * (2.55007738653F + t * (-0.598290411283F + t * 0.0776559122760F)));
    c = 0.999999999779F +
        t * (-4.93480213693F +
             t * (4.05870915476F + t * (-1.33521194939F + t * (0.234937068595F - t * 0.0243959320976F))));
  } else {
    s = 3.141592653589793116 +
        t * (-5.167712780049969368 +
             t * (2.55016403987730067 +
                  t * (-0.5992645293189446942 +
                       t * (0.08214588657310289976 +
                            t * (-0.007370430505916943618 +
                                 t * (0.0004662998161898393901 +
                                      t * (-2.190349707462601811e-05 + t * 7.697826768224190906e-07)))))));
    c = 1.0 + t * (-4.934802200544678996 +
                   t * (4.058712126416767596 +
                        t * (-1.33526276885455486 +
                             t * (0.2353306303579950076 +
                                  t * (-0.02580689137659296362 +
                                       t * (0.001929574187281234881 +
                                            t * (-0.0001046374168175213834 +
                                                 t * (4.300724172734847013e-06 + t * -1.3435212950953201e-07))))))));
  }
  sine = f * s;
  cosine = c;
}

/// x - y and what follows from its length.
template <typename Real>
struct PairDistance {
  Real dx, dy, dz;
  Real u;           // r
  Real fraction;    // u minus the nearest whole number
  Real reciprocal;  // 1/r, finite
  Real inverse;     // 1/r times (-1)^that number; 0 where r is
};

/// What the kernels of a pair share: e, E and 1/r^3 (the last with the sign of e's sine and cosine taken out of them).
template <typename Real>
struct PairWave {
  Real c, s;    // of e, before the sign
  Real er, ei;  // of E, likewise
  Real rho;     // k r
  Real near;    // 1 + alpha r
  Real b;       // 1/r^3 with that sign; 0 where r is
};

template <bool kDamped, typename Real>
TOUCHFIELD_EVERYWHERE inline PairWave<Real> pair_wave(const PairConstants<Real>& constants,
                                                      const PairDistance<Real>& d) {
  PairWave<Real> wave;
  half_cycle_sincos(d.fraction, wave.s, wave.c);
  wave.near = 1;
  if constexpr (kDamped) {
    const Real decay = constants.damping * d.u;
    const Real factor = std::exp(-decay);
    wave.s *= factor;
    wave.c *= factor;
    wave.near = Real(1) + decay;
  }
  wave.rho = static_cast<Real>(3.14159265358979323846) * d.u;
  wave.er = wave.near * wave.c + wave.rho * wave.s;
  wave.ei = wave.near * wave.s - wave.rho * wave.c;
  wave.b = d.inverse * (d.reciprocal * d.reciprocal);
  return wave;
}

/// i gamma W.
template <bool kDamped, typename Real>
TOUCHFIELD_EVERYWHERE inline void hypersingular_part(const PairConstants<Real>& constants, const PairWave<Real>& wave,
                                                     Real reciprocal, Real nd, Real md, Real normals, Real& re,
                                                     Real& im) {
  const Real mn = constants.gamma * wave.b * normals;
  const Real q = constants.gamma * wave.b * (reciprocal * reciprocal) * nd * md;
  // F = 3 E - (rho^2 - alpha^2 r^2 + 2 i rho alpha r) e
  Real fr = 3 * wave.er - wave.rho * wave.rho * wave.c;
  Real fi = 3 * wave.ei - wave.rho * wave.rho * wave.s;
  if constexpr (kDamped) {
    const Real decay = wave.near - Real(1);
    fr += decay * decay * wave.c + 2 * wave.rho * decay * wave.s;
    fi += decay * decay * wave.s - 2 * wave.rho * decay * wave.c;
  }
  re = fi * q - wave.ei * mn;
  im = wave.er * mn - fr * q;
}

/// One pair: kernel times 4 pi,
///
///   S = e/r   D = E (n.d)/r^3   D' = -E (m.d)/r^3   W = (E m.n - F (m.d)(n.d)/r^2)/r^3
///   e = exp(i kappa r), E = (1 - i kappa r) e, F = (3 - 3 i kappa r - (kappa r)^2) e, d = x - y
///
/// with m the normal at x and n at y; 0 where the points coincide.
template <Layer kLayer, bool kDamped, typename Real>
TOUCHFIELD_EVERYWHERE inline void pair_kernel(const PairConstants<Real>& constants, const PairDistance<Real>& d,
                                              Real mx, Real my, Real mz, Real nx, Real ny, Real nz, Real& re,
                                              Real& im) {
  const PairWave<Real> wave = pair_wave<kDamped>(constants, d);
  const Real nd = nx * d.dx + ny * d.dy + nz * d.dz;
  const Real md = mx * d.dx + my * d.dy + mz * d.dz;
  if constexpr (kLayer == Layer::kSingle) {
    re = d.inverse * wave.c;
    im = d.inverse * wave.s;
  } else if constexpr (kLayer == Layer::kSingleAdjoint) {
    const Real along = constants.gamma * wave.b * md;
    re = d.inverse * wave.c + wave.ei * along;
    im = d.inverse * wave.s - wave.er * along;
  } else {
    const Real along = kLayer == Layer::kDouble || kLayer == Layer::kBurtonMiller ? wave.b * nd : -wave.b * md;
    re = wave.er * along;
    im = wave.ei * along;
    if constexpr (kLayer == Layer::kBurtonMiller || kLayer == Layer::kAdjointMiller) {
      Real w_re;
      Real w_im;
      hypersingular_part<kDamped>(constants, wave, d.reciprocal, nd, md, mx * nx + my * ny + mz * nz, w_re, w_im);
      re += w_re;
      im += w_im;
    }
  }
}

}  // namespace touchfield::TOUCHFIELD_LEVEL
