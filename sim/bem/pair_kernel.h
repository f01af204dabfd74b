#pragma once

#include <bit>
#include <cmath>
#include <cstdint>
#include <type_traits>

#ifdef __AVX512F__
#include <immintrin.h>
#endif

#include "sim/bem/pair_formulas.h"

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

/// r2, reciprocal   r^2 and 1/r (finite) of x - y
template <typename Real>
inline PairDistance<Real> pair_distance(Real r2, Real reciprocal, Real dx, Real dy, Real dz) {
  const Real u = r2 * reciprocal;
  const Real whole = std::rint(u);
  return {dx, dy, dz, u, u - whole, reciprocal, alternate(r2 > Real(0) ? reciprocal : Real(0), whole)};
}

/// One pair seen from both its points: K(x, y) of kDouble or kBurtonMiller and K(y, x), in the same units. They share
/// all but one product each.
template <bool kMiller, bool kDamped, typename Real>
inline void mutual_kernel(const PairConstants<Real>& constants, const PairDistance<Real>& d, Real mx, Real my, Real mz,
                          Real nx, Real ny, Real nz, Real& to_re, Real& to_im, Real& from_re, Real& from_im) {
  const PairWave<Real> wave = pair_wave<kDamped>(constants, d);
  const Real nd = nx * d.dx + ny * d.dy + nz * d.dz;
  const Real md = mx * d.dx + my * d.dy + mz * d.dz;
  const Real to = wave.b * nd;
  const Real from = -wave.b * md;
  Real w_re = 0;
  Real w_im = 0;
  if constexpr (kMiller) {
    hypersingular_part<kDamped>(constants, wave, d.reciprocal, nd, md, mx * nx + my * ny + mz * nz, w_re, w_im);
  }
  to_re = wave.er * to + w_re;
  to_im = wave.ei * to + w_im;
  from_re = wave.er * from + w_re;
  from_im = wave.ei * from + w_im;
}

}  // namespace touchfield::TOUCHFIELD_LEVEL
