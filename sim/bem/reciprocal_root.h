#pragma once

#include <cmath>

#ifdef __AVX512F__
#include <immintrin.h>
#endif

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

}  // namespace touchfield::TOUCHFIELD_LEVEL
