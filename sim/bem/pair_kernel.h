#pragma once

#include <bit>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <type_traits>

#ifdef __AVX512F__
#include <immintrin.h>
#endif

#include "sim/bem/pair_loops.h"

namespace touchfield::TOUCHFIELD_LEVEL {

/// 1/sqrt(v + 1e-20) of `count` values v >= 0, so that 0 stays finite; relative accuracy a few roundings.
template <typename Real>
inline void reciprocal_roots(const Real* values, int count, Real* roots) {
#pragma omp simd
  for (int i = 0; i < count; ++i) {
    roots[i] = Real(1) / std::sqrt(values[i] + Real(1e-20));
  }
}

#ifdef __AVX512F__
// The compiler makes a root and a division of the above; the processor's estimate and a Newton step or two take a
// quarter of the time.
template <>
inline void reciprocal_roots<float>(const float* values, int count, float* roots) {
  const __m512 tiny = _mm512_set1_ps(1e-20F);
  const __m512 half = _mm512_set1_ps(0.5F);
  for (int i = 0; i < count; i += 16) {
    const int left = count - i;
    const auto mask = static_cast<__mmask16>(left >= 16 ? 0xffffU : (1U << static_cast<unsigned>(left)) - 1U);
    const __m512 v = _mm512_add_ps(_mm512_maskz_loadu_ps(mask, values + i), tiny);
    const __m512 y = _mm512_rsqrt14_ps(v);
    const __m512 rest = _mm512_fnmadd_ps(_mm512_mul_ps(v, y), _mm512_mul_ps(half, y), half);
    _mm512_mask_storeu_ps(roots + i, mask, _mm512_fmadd_ps(y, rest, y));
  }
}

template <>
inline void reciprocal_roots<double>(const double* values, int count, double* roots) {
  const __m512d tiny = _mm512_set1_pd(1e-20);
  const __m512d half = _mm512_set1_pd(0.5);
  for (int i = 0; i < count; i += 8) {
    const int left = count - i;
    const auto mask = static_cast<__mmask8>(left >= 8 ? 0xffU : (1U << static_cast<unsigned>(left)) - 1U);
    const __m512d v = _mm512_add_pd(_mm512_maskz_loadu_pd(mask, values + i), tiny);
    __m512d y = _mm512_rsqrt14_pd(v);
    for (int step = 0; step < 2; ++step) {  // 14, 28, 56 bits
      const __m512d rest = _mm512_fnmadd_pd(_mm512_mul_pd(v, y), _mm512_mul_pd(half, y), half);
      y = _mm512_fmadd_pd(y, rest, y);
    }
    _mm512_mask_storeu_pd(roots + i, mask, y);
  }
}
#endif

/// sin(pi f) and cos(pi f) without a call or a branch, so that loops over it become SIMD code.
///
/// f          |f| <= 1/2
/// accuracy   absolute error below 1.5e-8 (float), 1e-16 (double), plus rounding
/// method     polynomials in f^2, interpolated at Chebyshev nodes in exact arithmetic
template <typename Real>
inline void half_cycle_sincos(Real f, Real& sine, Real& cosine) {
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

/// value times (-1)^n.
template <typename Real>
inline Real alternate(Real value, Real n) {
  if constexpr (std::is_same_v<Real, float>) {
    const auto sign = static_cast<std::uint32_t>(static_cast<std::int32_t>(n)) << 31U;
    return std::bit_cast<float>(std::bit_cast<std::uint32_t>(value) ^ sign);
  } else {
    const auto sign = static_cast<std::uint64_t>(static_cast<std::int64_t>(n)) << 63U;
    return std::bit_cast<double>(std::bit_cast<std::uint64_t>(value) ^ sign);
  }
}

/// What the kernels of a pair share: e, E and 1/r^3 (the last with the sign of e's sine and cosine taken out of them).
template <typename Real>
struct PairWave {
  Real c, s;        // of e, before the sign
  Real er, ei;      // of E, likewise
  Real rho;         // k r
  Real near;        // 1 + alpha r
  Real inverse, b;  // 1/r and 1/r^3 with that sign; 0 where r is
};

template <bool kDamped, typename Real>
inline PairWave<Real> pair_wave(const PairConstants<Real>& constants, Real r2, Real reciprocal) {
  PairWave<Real> wave;
  const Real u = r2 * reciprocal;
  const Real whole = std::rint(u);
  half_cycle_sincos(u - whole, wave.s, wave.c);
  wave.inverse = alternate(r2 > Real(0) ? reciprocal : Real(0), whole);
  wave.near = 1;
  if constexpr (kDamped) {
    const Real decay = constants.damping * u;
    const Real factor = std::exp(-decay);
    wave.s *= factor;
    wave.c *= factor;
    wave.near = Real(1) + decay;
  }
  wave.rho = std::numbers::pi_v<Real> * u;
  wave.er = wave.near * wave.c + wave.rho * wave.s;
  wave.ei = wave.near * wave.s - wave.rho * wave.c;
  wave.b = wave.inverse * (reciprocal * reciprocal);
  return wave;
}

/// i gamma W.
template <bool kDamped, typename Real>
inline void hypersingular_part(const PairConstants<Real>& constants, const PairWave<Real>& wave, Real reciprocal,
                               Real nd, Real md, Real normals, Real& re, Real& im) {
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

/// One pair: kernel times 4 pi, in units of half wavelengths,
///
///   S = e/r   D = E (n.d)/r^3   D' = -E (m.d)/r^3   W = (E m.n - F (m.d)(n.d)/r^2)/r^3
///   e = exp(i kappa r), E = (1 - i kappa r) e, F = (3 - 3 i kappa r - (kappa r)^2) e, d = x - y
///
/// r2, reciprocal   r^2 and 1/r (finite); the kernel is 0 where r^2 is 0
template <Layer kLayer, bool kDamped, typename Real>
inline void pair_kernel(const PairConstants<Real>& constants, Real r2, Real reciprocal, Real dx, Real dy, Real dz,
                        Real mx, Real my, Real mz, Real nx, Real ny, Real nz, Real& re, Real& im) {
  const PairWave<Real> wave = pair_wave<kDamped>(constants, r2, reciprocal);
  const Real nd = nx * dx + ny * dy + nz * dz;
  const Real md = mx * dx + my * dy + mz * dz;
  if constexpr (kLayer == Layer::kSingle) {
    re = wave.inverse * wave.c;
    im = wave.inverse * wave.s;
  } else if constexpr (kLayer == Layer::kSingleAdjoint) {
    const Real along = constants.gamma * wave.b * md;
    re = wave.inverse * wave.c + wave.ei * along;
    im = wave.inverse * wave.s - wave.er * along;
  } else {
    const Real along = kLayer == Layer::kDouble || kLayer == Layer::kBurtonMiller ? wave.b * nd : -wave.b * md;
    re = wave.er * along;
    im = wave.ei * along;
    if constexpr (kLayer == Layer::kBurtonMiller || kLayer == Layer::kAdjointMiller) {
      Real w_re;
      Real w_im;
      hypersingular_part<kDamped>(constants, wave, reciprocal, nd, md, mx * nx + my * ny + mz * nz, w_re, w_im);
      re += w_re;
      im += w_im;
    }
  }
}

/// One pair seen from both its points: K(x, y) of kDouble or kBurtonMiller and K(y, x), in the same units. They share
/// all but one product each.
template <bool kMiller, bool kDamped, typename Real>
inline void mutual_kernel(const PairConstants<Real>& constants, Real r2, Real reciprocal, Real dx, Real dy, Real dz,
                          Real mx, Real my, Real mz, Real nx, Real ny, Real nz, Real& to_re, Real& to_im, Real& from_re,
                          Real& from_im) {
  const PairWave<Real> wave = pair_wave<kDamped>(constants, r2, reciprocal);
  const Real nd = nx * dx + ny * dy + nz * dz;
  const Real md = mx * dx + my * dy + mz * dz;
  const Real to = wave.b * nd;
  const Real from = -wave.b * md;
  Real w_re = 0;
  Real w_im = 0;
  if constexpr (kMiller) {
    hypersingular_part<kDamped>(constants, wave, reciprocal, nd, md, mx * nx + my * ny + mz * nz, w_re, w_im);
  }
  to_re = wave.er * to + w_re;
  to_im = wave.ei * to + w_im;
  from_re = wave.er * from + w_re;
  from_im = wave.ei * from + w_im;
}

}  // namespace touchfield::TOUCHFIELD_LEVEL
