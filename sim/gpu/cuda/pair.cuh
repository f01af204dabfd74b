#pragma once

#include <cstring>

#include "sim/bem/pair_loops.h"
#include "sim/gpu/cuda/vector.cuh"

namespace touchfield::cuda {

/// The kernels of pairs of points, by the formulas of sim/bem/pair_kernel.h, for the card and, in tests, for the host.
/// Lengths are in half wavelengths, so that k r = pi u.

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
__host__ __device__ inline float reciprocal_root(float v) {
#ifdef __CUDA_ARCH__
  return rsqrtf(v + 1e-20F);
#else
  return 1.0F / std::sqrt(v + 1e-20F);
#endif
}
__host__ __device__ inline double reciprocal_root(double v) {
#ifdef __CUDA_ARCH__
  return rsqrt(v + 1e-20);
#else
  return 1.0 / std::sqrt(v + 1e-20);
#endif
}

/// The nearest whole number, by adding what leaves it in the last bits: conversions are slow on the card.
template <typename Real>
struct NearestWhole {
  Real value;
  bool odd;
};

/// u   below 2^21 in magnitude
__host__ __device__ inline NearestWhole<float> nearest_whole(float u) {
  const float shift = 12582912.0F;  // 1.5 * 2^23
  const float shifted = u + shift;
#ifdef __CUDA_ARCH__
  const unsigned bits = __float_as_uint(shifted);
#else
  unsigned bits = 0;
  std::memcpy(&bits, &shifted, sizeof bits);
#endif
  return {shifted - shift, (bits & 1U) != 0};
}
__host__ __device__ inline NearestWhole<double> nearest_whole(double u) {
  const double shift = 6755399441055744.0;  // 1.5 * 2^52
  const double shifted = u + shift;
#ifdef __CUDA_ARCH__
  const auto bits = static_cast<unsigned>(__double2loint(shifted));
#else
  unsigned long long bits = 0;
  std::memcpy(&bits, &shifted, sizeof bits);
#endif
  return {shifted - shift, (bits & 1U) != 0};
}

/// sin(pi f) and cos(pi f), |f| <= 1/2; absolute error 1.5e-8 (float), 1e-16 (double), plus rounding. Polynomials of
/// pair_kernel.h.
__host__ __device__ inline void half_cycle_sincos(float f, float& sine, float& cosine) {
  const float t = f * f;
  const float s =
      3.14159264007720F + t * (-5.16771007667F + t * (2.55007738653F + t * (-0.598290411283F + t * 0.0776559122760F)));
  sine = f * s;
  cosine = 0.999999999779F +
           t * (-4.93480213693F +
                t * (4.05870915476F + t * (-1.33521194939F + t * (0.234937068595F - t * 0.0243959320976F))));
}
__host__ __device__ inline void half_cycle_sincos(double f, double& sine, double& cosine) {
  const double t = f * f;
  const double s = 3.141592653589793116 +
                   t * (-5.167712780049969368 +
                        t * (2.55016403987730067 +
                             t * (-0.5992645293189446942 +
                                  t * (0.08214588657310289976 +
                                       t * (-0.007370430505916943618 +
                                            t * (0.0004662998161898393901 +
                                                 t * (-2.190349707462601811e-05 + t * 7.697826768224190906e-07)))))));
  sine = f * s;
  cosine = 1.0 + t * (-4.934802200544678996 +
                      t * (4.058712126416767596 +
                           t * (-1.33526276885455486 +
                                t * (0.2353306303579950076 +
                                     t * (-0.02580689137659296362 +
                                          t * (0.001929574187281234881 +
                                               t * (-0.0001046374168175213834 +
                                                    t * (4.300724172734847013e-06 + t * -1.3435212950953201e-07))))))));
}

/// x - y and what follows from its length alone.
template <typename Real>
struct PairDistance {
  Real dx, dy, dz;
  Real u;           // r
  Real fraction;    // u minus the nearest whole number
  Real reciprocal;  // 1/r, finite
  Real inverse;     // 1/r times (-1)^that number; 0 where r is
};

template <typename Real>
__host__ __device__ inline PairDistance<Real> pair_distance(Real dx, Real dy, Real dz) {
  const Real r2 = dx * dx + dy * dy + dz * dz;
  const Real reciprocal = reciprocal_root(r2);
  const Real u = r2 * reciprocal;
  const NearestWhole<Real> whole = nearest_whole(u);
  const Real inverse = r2 > Real(0) ? reciprocal : Real(0);
  return {dx, dy, dz, u, u - whole.value, reciprocal, whole.odd ? -inverse : inverse};
}

/// The same in single precision from a difference in double, the phase with an error of 1e-7 wherever the points lie.
__host__ __device__ inline PairDistance<float> precise_distance(double dx, double dy, double dz) {
  PairDistance<float> d;
  d.dx = static_cast<float>(dx);
  d.dy = static_cast<float>(dy);
  d.dz = static_cast<float>(dz);
  const float r2 = d.dx * d.dx + d.dy * d.dy + d.dz * d.dz;
  d.reciprocal = reciprocal_root(r2);
  d.u = r2 * d.reciprocal;
  const double y = d.reciprocal;  // a step of Newton's makes 7 digits 14
  const double rough = (dx * dx + dy * dy + dz * dz) * y;
  const double u = rough + 0.5 * rough * (1.0 - rough * y);
  const NearestWhole<double> whole = nearest_whole(u);
  d.fraction = static_cast<float>(u - whole.value);
  const float inverse = r2 > 0.0F ? d.reciprocal : 0.0F;
  d.inverse = whole.odd ? -inverse : inverse;
  return d;
}

/// Between places in single precision, or in double.
__host__ __device__ inline PairDistance<float> distance_between(const float3& x, const float3& y) {
  return pair_distance(x.x - y.x, x.y - y.y, x.z - y.z);
}
__host__ __device__ inline PairDistance<float> distance_between(const Vector& x, const Vector& y) {
  return precise_distance(x.x - y.x, x.y - y.y, x.z - y.z);
}

/// One pair: kernel times 4 pi, K(x, y) of the layer,
///
///   S = e/r   D = E (n.d)/r^3   D' = -E (m.d)/r^3   W = (E m.n - F (m.d)(n.d)/r^2)/r^3
///   e = exp(i kappa r), E = (1 - i kappa r) e, F = (3 - 3 i kappa r - (kappa r)^2) e, d = x - y
///
/// with m the normal at x and n at y; 0 where the points coincide.
/// accuracy   float 3e-7 (1 + k r) relative, of precise_distance 3e-7; double 1e-15 (1 + k r)
template <Layer kLayer, bool kDamped, typename Real>
__host__ __device__ inline void pair_kernel(const PairConstants<Real>& constants, const PairDistance<Real>& d, Real mx,
                                            Real my, Real mz, Real nx, Real ny, Real nz, Real& re, Real& im) {
  Real s;
  Real c;
  half_cycle_sincos(d.fraction, s, c);
  Real near = 1;  // 1 + alpha r
  if constexpr (kDamped) {
    const Real decay = constants.damping * d.u;
    const Real factor = std::exp(-decay);
    s *= factor;
    c *= factor;
    near = Real(1) + decay;
  }
  if constexpr (kLayer == Layer::kSingle) {
    re = d.inverse * c;
    im = d.inverse * s;
  } else {
    const Real rho = static_cast<Real>(kPi) * d.u;
    const Real er = near * c + rho * s;
    const Real ei = near * s - rho * c;
    const Real b = d.inverse * (d.reciprocal * d.reciprocal);
    const Real nd = nx * d.dx + ny * d.dy + nz * d.dz;
    const Real md = mx * d.dx + my * d.dy + mz * d.dz;
    const Real along = kLayer == Layer::kDouble || kLayer == Layer::kBurtonMiller ? b * nd : -b * md;
    re = er * along;
    im = ei * along;
    if constexpr (kLayer == Layer::kBurtonMiller || kLayer == Layer::kAdjointMiller) {
      const Real mn = constants.gamma * b * (mx * nx + my * ny + mz * nz);
      const Real q = constants.gamma * b * (d.reciprocal * d.reciprocal) * nd * md;
      // F = 3 E - (rho^2 - alpha^2 r^2 + 2 i rho alpha r) e
      Real fr = 3 * er - rho * rho * c;
      Real fi = 3 * ei - rho * rho * s;
      if constexpr (kDamped) {
        const Real decay = near - Real(1);
        fr += decay * decay * c + 2 * rho * decay * s;
        fi += decay * decay * s - 2 * rho * decay * c;
      }
      re += fi * q - ei * mn;
      im += er * mn - fr * q;
    }
  }
}

/// The same at k = 0, of D, D', D + i gamma W and D' + i gamma W; d is not zero.
template <Layer kLayer>
__host__ __device__ inline void static_kernel(double gamma, const PairDistance<double>& d, const Vector& m,
                                              const Vector& n, double& re, double& im) {
  constexpr bool kAdjoint = kLayer == Layer::kAdjoint || kLayer == Layer::kAdjointMiller;
  constexpr bool kMiller = kLayer == Layer::kBurtonMiller || kLayer == Layer::kAdjointMiller;
  const Vector offset{d.dx, d.dy, d.dz};
  const double inverse2 = d.reciprocal * d.reciprocal;
  const double b = d.reciprocal * inverse2;
  const double nd = dot(n, offset);
  const double md = dot(m, offset);
  re = kAdjoint ? -b * md : b * nd;
  im = kMiller ? gamma * b * (dot(m, n) - 3.0 * nd * md * inverse2) : 0.0;
}

}  // namespace touchfield::cuda
