#pragma once

#include "sim/gpu/cuda/pair.cuh"

namespace touchfield::cuda {

/// Integrals over flat faces by the rules of sim/bem/quadrature.h, for the card and, in tests, for the host.

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

  __host__ __device__ double reach() const { return three_below > seven_below ? three_below : seven_below; }
};

enum class FaceKind { kOnePoint, kThreePoints, kSevenPoints, kSplit };

__host__ __device__ inline bool is_split(const NearRule& rule, double distance2, double area) {
  return distance2 < rounded_product(rounded_product(rule.split_ratio, rule.split_ratio), area);
}

/// distance2   of the point from the face's centroid, squared_norm
__host__ __device__ inline FaceKind face_kind(const NearRule& rule, double distance2, double area) {
  const double distance = std::sqrt(distance2);
  const double size = std::sqrt(area);
  if (distance < rounded_product(rule.seven_below, size)) {
    return is_split(rule, distance2, area) ? FaceKind::kSplit : FaceKind::kSevenPoints;
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

/// Sums of a layer's kernel over points of faces, seen from x with normal m there.
template <Layer kLayer, bool kDamped>
struct FaceSum {
  static constexpr bool kAdjoint = kLayer == Layer::kAdjoint || kLayer == Layer::kAdjointMiller;
  static constexpr bool kMiller = kLayer == Layer::kBurtonMiller || kLayer == Layer::kAdjointMiller;
  static constexpr int kDeepest = 12;  // halvings of a face

  double scale;
  PairConstants<double> constants;
  Vector x, m;
  double re = 0.0, im = 0.0;

  __host__ __device__ FaceSum(const SurfaceWave& wave, const Vector& place, const Vector& normal)
      : scale(wave.scale()), constants(wave.constants<double>()), x(place), m(normal) {}

  /// kRemainder: without the static part that exact_static() gives.
  template <bool kRemainder>
  __host__ __device__ void add_point(const Vector& y, const Vector& n, double weight) {
    const Vector offset = scale * (x - y);
    const PairDistance<double> d = pair_distance(offset.x, offset.y, offset.z);
    double kernel_re;
    double kernel_im;
    pair_kernel<kLayer, kDamped>(constants, d, m.x, m.y, m.z, n.x, n.y, n.z, kernel_re, kernel_im);
    if constexpr (kRemainder && kLayer != Layer::kSingle) {
      double static_re;
      double static_im;
      static_kernel<kLayer>(constants.gamma, d, m, n, static_re, static_im);
      kernel_re -= kAdjoint ? 0.0 : static_re;  // the adjoint's is no loop round the edges
      kernel_im -= static_im;
    }
    const double units = weight * scale * scale / (4.0 * kPi);
    re += units * kernel_re;
    im += units * kernel_im;
  }

  template <bool kRemainder>
  __host__ __device__ void add_at(const Vector& a, const Vector& b, const Vector& c, const Vector& n, double u,
                                  double v, double weight) {
    add_point<kRemainder>(a + u * (b - a) + v * (c - a), n, weight);
  }

  /// Three inner points, or Radon's seven.
  template <bool kRemainder>
  __host__ __device__ void add_orbit(const Vector& a, const Vector& b, const Vector& c, const Vector& n, double s,
                                     double weight) {
    for (int corner = 0; corner < 3; ++corner) {
      add_at<kRemainder>(a, b, c, n, corner == 1 ? 1.0 - 2.0 * s : s, corner == 2 ? 1.0 - 2.0 * s : s, weight);
    }
  }
  __host__ __device__ void add_three(const Triangle& face) {
    add_orbit<false>(face.a, face.b, face.c, face.normal, 1.0 / 6.0, face.area / 3.0);
  }
  __host__ __device__ void add_seven(const Vector& a, const Vector& b, const Vector& c, const Vector& n, double area) {
    const double root = 3.87298334620741688518;  // of 15
    add_at<true>(a, b, c, n, 1.0 / 3.0, 1.0 / 3.0, 9.0 / 40.0 * area);
    for (int orbit = 0; orbit < 2; ++orbit) {
      const double signed_root = orbit == 0 ? -root : root;
      add_orbit<true>(a, b, c, n, (6.0 + signed_root) / 21.0, (155.0 + signed_root) / 1200.0 * area);
    }
  }

  /// Seven points on each piece of the face, or of a quarter of it (0..3; -1: all), split as FaceQuadrature does. A piece
  /// is known by the quarters on the way to it, two bits each, and made anew from the face: no stack is kept.
  __host__ __device__ void add_pieces(const Triangle& face, double split_ratio, int quarter) {
    const double split2 = rounded_product(split_ratio, split_ratio);
    const int top = quarter < 0 ? 0 : 1;
    unsigned path = quarter < 0 ? 0U : static_cast<unsigned>(quarter);
    int depth = top;
    for (;;) {
      Vector a = face.a;
      Vector b = face.b;
      Vector c = face.c;
      double area = face.area;
      for (int level = depth - 1; level >= 0; --level) {
        const unsigned part = path >> (2U * static_cast<unsigned>(level)) & 3U;
        const Vector ab = 0.5 * (a + b);
        const Vector bc = 0.5 * (b + c);
        const Vector ca = 0.5 * (c + a);
        a = part == 0 ? a : (part == 2 ? ca : ab);
        b = part == 0 ? ab : (part == 1 ? b : bc);
        c = part == 1 ? bc : (part == 2 ? c : ca);
        area *= 0.25;
      }
      if (depth < kDeepest && squared_norm(x - (a + b + c) / 3.0) < rounded_product(split2, area)) {
        path <<= 2U;
        ++depth;
        continue;
      }
      add_seven(a, b, c, face.normal, area);
      while (depth > top && (path & 3U) == 3U) {
        path >>= 2U;
        --depth;
      }
      if (depth == top) {
        return;
      }
      ++path;
    }
  }

  /// The static part of D and W, which seven points leave out: D0 = Omega / 4 pi, W0 = m . grad D0.
  __host__ __device__ void add_exact_static(const Triangle& face) {
    if constexpr (kLayer != Layer::kSingle) {
      if constexpr (!kAdjoint) {
        re += solid_angle(face, x) / (4.0 * kPi);
      }
      if constexpr (kMiller) {
        im += constants.gamma / scale * (dot(m, solid_angle_gradient(face, x)) / (4.0 * kPi));
      }
    }
  }

  /// All of a face by its kind; what it adds is the integral over it (of kSingle in half wavelengths).
  __host__ __device__ void add_face(const Triangle& face, const Vector& centroid, FaceKind kind, double split_ratio) {
    if (kind == FaceKind::kOnePoint) {
      add_point<false>(centroid, face.normal, face.area);
    } else if (kind == FaceKind::kThreePoints) {
      add_three(face);
    } else {
      add_exact_static(face);
      add_pieces(face, split_ratio, -1);
    }
  }
};

/// The finite part of W over a face itself at its centroid [1/m], by self_integrals' loop round its edges, 16 points each.
__host__ __device__ inline double2 self_hypersingular(const Vector& a, const Vector& b, const Vector& c, double k,
                                                      double alpha) {
  const double node[8] = {0.0950125098376374402, 0.2816035507792589132, 0.4580167776572273863, 0.6178762444026437484,
                          0.7554044083550030339, 0.8656312023878317439, 0.9445750230732325761, 0.9894009349916499326};
  const double weight[8] = {0.1894506104550684963, 0.1826034150449235889, 0.1691565193950025382, 0.1495959888165767321,
                            0.1246289712555338721, 0.0951585116824927848, 0.0622535239386478929, 0.0271524594117540949};
  const Vector centre = (a + b + c) / 3.0;
  double re = 0.0;
  double im = 0.0;
  for (int e = 0; e < 3; ++e) {
    const Vector from_corner = (e == 0 ? a : (e == 1 ? b : c)) - centre;
    const Vector to_corner = (e == 0 ? b : (e == 1 ? c : a)) - centre;
    const Vector edge = to_corner - from_corner;
    const Vector along = edge / norm(edge);
    const double h = norm(from_corner - dot(along, from_corner) * along);
    const double from = std::asinh(dot(along, from_corner) / h);
    const double to = std::asinh(dot(along, to_corner) / h);
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
