#pragma once

#include <cstring>

#define TOUCHFIELD_LEVEL cuda
#include "sim/bem/pair_formulas.h"
#undef TOUCHFIELD_LEVEL
#include "sim/gpu/cuda/vector.cuh"

namespace touchfield::cuda {

/// The kernels of pairs of points, for the card. Lengths are in half wavelengths, so that k r = pi u.

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

/// Integrals over flat faces by the rules of sim/bem/quadrature.h.

struct FaceGeometry {
  Vector centroid, normal;
  double area;
};

struct Triangle {
  Vector a, b, c;  // corners [m], counter-clockwise seen from the normal's side
  Vector normal;
  double area;
};

/// By TriangleMesh's operations, to the last bit.
__host__ __device__ inline FaceGeometry face_geometry(const Vector& a, const Vector& b, const Vector& c) {
  const Vector twice = cross(b - a, c - a);
  const double area = 0.5 * norm(twice);
  return {(a + b + c) / 3.0, twice / (2.0 * area), area};
}

/// How finely a face is integrated, as FaceRule says, by its distance in square roots of its area.
struct NearRule {
  double split_ratio = 1.4;
  double seven_below = 3.0;
  double three_below = 8.0;

  __host__ __device__ double split2() const { return rounded_product(split_ratio, split_ratio); }
};

enum class FaceKind { kOnePoint, kThreePoints, kSevenPoints, kSplit };

/// distance2   of the point from the face's centroid, squared_norm
__host__ __device__ inline FaceKind face_kind(const NearRule& rule, double distance2, double area) {
  const double distance = std::sqrt(distance2);
  const double size = std::sqrt(area);
  if (distance < rounded_product(rule.seven_below, size)) {
    return distance2 < rounded_product(rule.split2(), area) ? FaceKind::kSplit : FaceKind::kSevenPoints;
  }
  return distance < rounded_product(rule.three_below, size) ? FaceKind::kThreePoints : FaceKind::kOnePoint;
}

/// Signed solid angle of a face seen from x [sr], positive on its normal's side.
__host__ __device__ inline double solid_angle(const Triangle& face, const Vector& x) {
  const Vector a = face.a - x;
  const Vector b = face.b - x;
  const Vector c = face.c - x;
  const double la = norm(a);
  const double lb = norm(b);
  const double lc = norm(c);
  return -2.0 * std::atan2(dot(a, cross(b, c)), la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb);
}

/// Its gradient in x [sr/m].
__host__ __device__ inline Vector edge_gradient(const Vector& a, const Vector& b) {
  const double la = norm(a);
  const double lb = norm(b);
  return (la + lb) / (la * lb * (la * lb + dot(a, b))) * cross(a, b);
}
__host__ __device__ inline Vector solid_angle_gradient(const Triangle& face, const Vector& x) {
  const Vector a = face.a - x;
  const Vector b = face.b - x;
  const Vector c = face.c - x;
  return -1.0 * (edge_gradient(a, b) + edge_gradient(b, c) + edge_gradient(c, a));
}

/// The integral of D + i gamma W over a face, seen from x with unit normal m there: what is added is summed.
template <bool kDamped>
struct FaceSum {
  static constexpr int kDeepest = 12;  // halvings of a face

  double scale;
  PairConstants<double> constants;
  Vector x, m;
  double re = 0.0, im = 0.0;

  __host__ __device__ FaceSum(const SurfaceWave& wave, const Vector& place, const Vector& normal)
      : scale(wave.scale()), constants(wave.constants<double>()), x(place), m(normal) {}

  /// kRemainder: without the static part, which add_exact_static() gives.
  template <bool kRemainder>
  __host__ __device__ void add_point(const Vector& y, const Vector& n, double weight) {
    const PairDistance<double> d = pair_distance<double>(scale * (x - y));
    double kernel_re;
    double kernel_im;
    pair_kernel<Layer::kBurtonMiller, kDamped>(constants, d, m, n, kernel_re, kernel_im);
    if constexpr (kRemainder) {
      const Vector offset{d.dx, d.dy, d.dz};
      const double inverse2 = d.reciprocal * d.reciprocal;
      const double b = d.reciprocal * inverse2;
      const double nd = dot(n, offset);
      kernel_re -= b * nd;
      kernel_im -= constants.gamma * b * (dot(m, n) - 3.0 * nd * dot(m, offset) * inverse2);
    }
    const double units = weight * scale * scale / (4.0 * kPi);
    re += units * kernel_re;
    im += units * kernel_im;
  }

  /// Three inner points, or three of Radon's seven.
  template <bool kRemainder>
  __host__ __device__ void add_orbit(const Triangle& face, double s, double weight) {
    for (int corner = 0; corner < 3; ++corner) {
      const double u = corner == 1 ? 1.0 - 2.0 * s : s;
      const double v = corner == 2 ? 1.0 - 2.0 * s : s;
      add_point<kRemainder>(face.a + u * (face.b - face.a) + v * (face.c - face.a), face.normal, weight * face.area);
    }
  }
  __host__ __device__ void add_three(const Triangle& face) { add_orbit<false>(face, 1.0 / 6.0, 1.0 / 3.0); }
  __host__ __device__ void add_seven(const Triangle& face) {
    add_point<true>((face.a + face.b + face.c) / 3.0, face.normal, 9.0 / 40.0 * face.area);
    for (int sign = -1; sign <= 1; sign += 2) {
      const double root = sign * 3.87298334620741688518;  // of 15
      add_orbit<true>(face, (6.0 + root) / 21.0, (155.0 + root) / 1200.0);
    }
  }

  /// Seven points on each piece of a quarter (0..3) of a face, split as FaceQuadrature does. A piece is known by the
  /// quarters on the way to it, two bits each, and made anew from the face: no stack is kept.
  __host__ __device__ void add_quarter(const Triangle& face, double split2, unsigned quarter) {
    unsigned path = quarter;
    for (int depth = 1;;) {
      Triangle piece = face;
      for (int level = 2 * (depth - 1); level >= 0; level -= 2) {
        const unsigned part = path >> static_cast<unsigned>(level) & 3U;
        const Vector ab = 0.5 * (piece.a + piece.b);
        const Vector bc = 0.5 * (piece.b + piece.c);
        const Vector ca = 0.5 * (piece.c + piece.a);
        piece.a = part == 0 ? piece.a : (part == 2 ? ca : ab);
        piece.b = part == 0 ? ab : (part == 1 ? piece.b : bc);
        piece.c = part == 1 ? bc : (part == 2 ? piece.c : ca);
        piece.area *= 0.25;
      }
      const Vector centroid = (piece.a + piece.b + piece.c) / 3.0;
      if (depth < kDeepest && squared_norm(x - centroid) < rounded_product(split2, piece.area)) {
        path <<= 2U;
        ++depth;
        continue;
      }
      add_seven(piece);
      for (; depth > 1 && (path & 3U) == 3U; --depth) {
        path >>= 2U;
      }
      if (depth == 1) {
        return;
      }
      ++path;
    }
  }

  /// What seven points leave out: D0 = Omega / 4 pi, W0 = m . grad D0.
  __host__ __device__ void add_exact_static(const Triangle& face) {
    re += solid_angle(face, x) / (4.0 * kPi);
    im += constants.gamma / scale * (dot(m, solid_angle_gradient(face, x)) / (4.0 * kPi));
  }
};

/// The finite part of W over a face itself at its centroid [1/m], by self_integrals' loop round its edges, 16 points
/// each.
__host__ __device__ inline double2 self_hypersingular(const Triangle& face, double k, double alpha) {
  const double node[8] = {0.0950125098376374402, 0.2816035507792589132, 0.4580167776572273863, 0.6178762444026437484,
                          0.7554044083550030339, 0.8656312023878317439, 0.9445750230732325761, 0.9894009349916499326};
  const double weight[8] = {0.1894506104550684963, 0.1826034150449235889, 0.1691565193950025382, 0.1495959888165767321,
                            0.1246289712555338721, 0.0951585116824927848, 0.0622535239386478929, 0.0271524594117540949};
  const Vector centre = (face.a + face.b + face.c) / 3.0;
  const Vector corners[3] = {face.a - centre, face.b - centre, face.c - centre};
  double re = 0.0;
  double im = 0.0;
  for (int e = 0; e < 3; ++e) {
    const Vector& a = corners[e];
    const Vector& b = corners[(e + 1) % 3];
    const Vector along = (b - a) / norm(b - a);
    const double h = norm(a - dot(along, a) * along);
    const double from = std::asinh(dot(along, a) / h);
    const double to = std::asinh(dot(along, b) / h);
    const double half = 0.5 * (to - from);
    for (int q = 0; q < 16; ++q) {
      const double t = 0.5 * (from + to) + (q < 8 ? -half : half) * node[q & 7];
      const double lengthening = std::cosh(t);
      const double radius = h * lengthening;
      // (exp(i kappa r) - 1 - i kappa r) / r
      const double decay = std::exp(-alpha * radius);
      const double share = half * weight[q & 7] / (lengthening * radius);
      double sine;
      double cosine;
      ::sincos(k * radius, &sine, &cosine);
      re -= share * (decay * cosine - 1.0 + alpha * radius);
      im -= share * (decay * sine - k * radius);
    }
    re -= (std::tanh(to) - std::tanh(from)) / h;
  }
  return {re / (4.0 * kPi), im / (4.0 * kPi)};
}

}  // namespace touchfield::cuda
