#pragma once

#include <cstring>

#define TOUCHFIELD_LEVEL cuda
#include "sim/bem/pair_formulas.h"
#undef TOUCHFIELD_LEVEL
#include "sim/gpu/cuda/vector.cuh"

namespace touchfield::cuda {

/// The kernels of pairs of points, for the card and, in tests, for the host. Lengths are in half wavelengths, so that
/// k r = pi u.

/// Wavenumber k + i alpha [1/m] and coupling gamma [m], eta = i gamma, of a surface.
struct SurfaceWave {
  double k, alpha, gamma;

  /// Half wavelengths a metre.
  __host__ __device__ double scale() const { return k / kPi; }
  template <typename Real>
  __host__ __device__ PairConstants<Real> constants() const {
    return {static_cast<Real>(kPi * alpha / k), static_cast<Real>(gamma * scale())};
  }
};

/// 1/sqrt(v + 1e-20), so that 0 stays finite.
template <typename Real>
__host__ __device__ inline Real reciprocal_root(Real v) {
#ifdef __CUDA_ARCH__
  return rsqrt(v + Real(1e-20));
#else
  return Real(1) / std::sqrt(v + Real(1e-20));
#endif
}

/// Of a difference in double: in single precision too the phase has an error of 1e-7 wherever the points lie.
template <typename Real>
__host__ __device__ inline PairDistance<Real> pair_distance(const Vector& difference) {
  PairDistance<Real> d;
  d.dx = static_cast<Real>(difference.x);
  d.dy = static_cast<Real>(difference.y);
  d.dz = static_cast<Real>(difference.z);
  const Real r2 = d.dx * d.dx + d.dy * d.dy + d.dz * d.dz;
  d.reciprocal = reciprocal_root(r2);
  d.u = r2 * d.reciprocal;
  double u = dot(difference, difference) * d.reciprocal;
  u += 0.5 * u * (1.0 - u * d.reciprocal);  // a step of Newton's makes 7 digits 14
  // The nearest whole number, by adding what leaves it in the last bits: conversions are slow on the card.
  const double shift = 6755399441055744.0;  // 1.5 * 2^52
  const double shifted = u + shift;
  unsigned long long bits;
  std::memcpy(&bits, &shifted, sizeof bits);
  d.fraction = static_cast<Real>(u - (shifted - shift));
  const Real inverse = r2 > Real(0) ? d.reciprocal : Real(0);
  d.inverse = (bits & 1U) != 0 ? -inverse : inverse;
  return d;
}

/// pair_kernel for vectors.
///
/// accuracy   float 3e-7 relative, double 1e-15 (1 + k r)
template <Layer kLayer, bool kDamped, typename Real, typename Normal>
__host__ __device__ inline void pair_kernel(const PairConstants<Real>& constants, const PairDistance<Real>& d,
                                            const Normal& m, const Normal& n, Real& re, Real& im) {
  pair_kernel<kLayer, kDamped>(constants, d, m.x, m.y, m.z, n.x, n.y, n.z, re, im);
}

}  // namespace touchfield::cuda
