// The loops over pairs for one instruction level: compiled once a level, in a namespace named after it
// (TOUCHFIELD_LEVEL), with relaxed floating-point rules, so that they become SIMD code. No inline function of it may be
// shared with other files: the linker could give them this level's instructions (a test looks for such symbols).
#include <cmath>

#include "sim/bem/pair_kernel.h"

namespace touchfield::TOUCHFIELD_LEVEL {

int near_sources(const PairPoint<double>& point, const PairSources<double>& sources, const double* reach_squared,
                 int count, int* near);  // near_sources_level.cpp

namespace {

constexpr int kBlock = kPairBlock;  // sources a pass: distances stay in the first cache

/// Squared distances of `count` sources from a point, and their reciprocal roots.
template <typename Real>
inline void distances(const PairPoint<Real>& p, const Real* x, const Real* y, const Real* z, int count, Real* r2,
                      Real* reciprocal) {
#pragma omp simd
  for (int j = 0; j < count; ++j) {
    const Real dx = p.x - x[j];
    const Real dy = p.y - y[j];
    const Real dz = p.z - z[j];
    r2[j] = dx * dx + dy * dy + dz * dz;
  }
  reciprocal_roots(r2, count, reciprocal);
}

template <Layer kLayer, bool kDamped, typename Real>
void fill(const PairConstants<Real>& given, const PairPoint<Real>& at, const PairSources<Real>& sources, int total,
          Real* re, Real* im) {
  const PairConstants<Real> constants = given;  // copies that re and im cannot alias
  const PairPoint<Real> p = at;
  alignas(64) Real r2[kBlock];
  alignas(64) Real reciprocal[kBlock];
  for (int first = 0; first < total; first += kBlock) {
    const int count = total - first < kBlock ? total - first : kBlock;
    const Real* x = sources.x + first;
    const Real* y = sources.y + first;
    const Real* z = sources.z + first;
    const Real* nx = sources.nx + first;
    const Real* ny = sources.ny + first;
    const Real* nz = sources.nz + first;
    distances(p, x, y, z, count, r2, reciprocal);
#pragma omp simd
    for (int j = 0; j < count; ++j) {
      const PairDistance<Real> d = pair_distance(r2[j], reciprocal[j], p.x - x[j], p.y - y[j], p.z - z[j]);
      pair_kernel<kLayer, kDamped>(constants, d, p.nx, p.ny, p.nz, nx[j], ny[j], nz[j], re[first + j], im[first + j]);
    }
  }
}

template <Layer kLayer, typename Real>
void fill(const PairConstants<Real>& constants, const PairPoint<Real>& at, const PairSources<Real>& sources, int count,
          Real* re, Real* im) {
  if (constants.damping != Real(0)) {
    fill<kLayer, true>(constants, at, sources, count, re, im);
  } else {
    fill<kLayer, false>(constants, at, sources, count, re, im);
  }
}

template <bool kMiller, bool kDamped, typename Real>
void add_mutual(bool transposed, const PairConstants<Real>& given, const PairPoint<Real>& at,
                const PairSources<Real>& sources, int count, const MutualSums<Real>& sums) {
  const PairConstants<Real> constants = given;
  const PairPoint<Real> p = at;
  const Real* x = sources.x;
  const Real* y = sources.y;
  const Real* z = sources.z;
  const Real* nx = sources.nx;
  const Real* ny = sources.ny;
  const Real* nz = sources.nz;
  alignas(64) Real r2[kBlock];
  alignas(64) Real reciprocal[kBlock];
  alignas(64) Real k_re[kBlock];
  alignas(64) Real k_im[kBlock];
  alignas(64) Real t_re[kBlock];
  alignas(64) Real t_im[kBlock];
  distances(p, x, y, z, count, r2, reciprocal);
  Real* to_re = transposed ? t_re : k_re;
  Real* to_im = transposed ? t_im : k_im;
  Real* from_re = transposed ? k_re : t_re;
  Real* from_im = transposed ? k_im : t_im;
#pragma omp simd
  for (int j = 0; j < count; ++j) {
    const PairDistance<Real> d = pair_distance(r2[j], reciprocal[j], p.x - x[j], p.y - y[j], p.z - z[j]);
    mutual_kernel<kMiller, kDamped>(constants, d, p.nx, p.ny, p.nz, nx[j], ny[j], nz[j], to_re[j], to_im[j], from_re[j],
                                    from_im[j]);
  }
  for (int s = 0; s < sums.right_hand_sides; ++s) {
    const Real* v_re = sums.source_re + s * sums.stride;
    const Real* v_im = sums.source_im + s * sums.stride;
    Real* out_re = sums.source_sum_re + s * sums.stride;
    Real* out_im = sums.source_sum_im + s * sums.stride;
    const Real p_re = sums.point_re[s];
    const Real p_im = sums.point_im[s];
    Real sum_re = 0;
    Real sum_im = 0;
#pragma omp simd reduction(+ : sum_re, sum_im)
    for (int j = 0; j < count; ++j) {
      sum_re += k_re[j] * v_re[j] - k_im[j] * v_im[j];
      sum_im += k_re[j] * v_im[j] + k_im[j] * v_re[j];
      out_re[j] += t_re[j] * p_re - t_im[j] * p_im;
      out_im[j] += t_re[j] * p_im + t_im[j] * p_re;
    }
    sums.point_sum_re[s] = sum_re;
    sums.point_sum_im[s] = sum_im;
  }
}

template <typename Real>
void pair_values(Layer layer, const PairConstants<Real>& constants, const PairPoint<Real>& point,
                 const PairSources<Real>& sources, int count, Real* re, Real* im) {
  switch (layer) {
    case Layer::kSingle:
      return fill<Layer::kSingle>(constants, point, sources, count, re, im);
    case Layer::kDouble:
      return fill<Layer::kDouble>(constants, point, sources, count, re, im);
    case Layer::kAdjoint:
      return fill<Layer::kAdjoint>(constants, point, sources, count, re, im);
    case Layer::kBurtonMiller:
      return fill<Layer::kBurtonMiller>(constants, point, sources, count, re, im);
    case Layer::kAdjointMiller:
      return fill<Layer::kAdjointMiller>(constants, point, sources, count, re, im);
    case Layer::kSingleAdjoint:
      return fill<Layer::kSingleAdjoint>(constants, point, sources, count, re, im);
  }
}

template <typename Real>
void add_mutual_sums(Layer layer, bool transposed, const PairConstants<Real>& constants, const PairPoint<Real>& point,
                     const PairSources<Real>& sources, int count, const MutualSums<Real>& sums) {
  const bool damped = constants.damping != Real(0);
  if (layer == Layer::kBurtonMiller) {
    damped ? add_mutual<true, true>(transposed, constants, point, sources, count, sums)
           : add_mutual<true, false>(transposed, constants, point, sources, count, sums);
  } else {
    damped ? add_mutual<false, true>(transposed, constants, point, sources, count, sums)
           : add_mutual<false, false>(transposed, constants, point, sources, count, sums);
  }
}

template <typename Real>
PairProducts<Real> pair_products(const Real* a_re, const Real* a_im, const Real* b_re, const Real* b_im, int count) {
  Real rr = 0;
  Real ii = 0;
  Real ri = 0;
  Real ir = 0;
#pragma omp simd reduction(+ : rr, ii, ri, ir)
  for (int j = 0; j < count; ++j) {
    rr += a_re[j] * b_re[j];
    ii += a_im[j] * b_im[j];
    ri += a_re[j] * b_im[j];
    ir += a_im[j] * b_re[j];
  }
  return {rr, ii, ri, ir};
}

void static_values(Layer layer, double gamma, const PairPoint<double>& point, const PairSources<double>& sources,
                   int count, double* re, double* im) {
  const PairPoint<double> p = point;
  const bool adjoint = layer == Layer::kAdjoint || layer == Layer::kAdjointMiller;
  const double g = layer == Layer::kBurtonMiller || layer == Layer::kAdjointMiller ? gamma : 0.0;
#pragma omp simd
  for (int j = 0; j < count; ++j) {
    const double dx = p.x - sources.x[j];
    const double dy = p.y - sources.y[j];
    const double dz = p.z - sources.z[j];
    const double inverse = 1.0 / std::sqrt(dx * dx + dy * dy + dz * dz + 1e-20);
    const double b = inverse * inverse * inverse;
    const double nd = sources.nx[j] * dx + sources.ny[j] * dy + sources.nz[j] * dz;
    const double md = p.nx * dx + p.ny * dy + p.nz * dz;
    const double mn = p.nx * sources.nx[j] + p.ny * sources.ny[j] + p.nz * sources.nz[j];
    re[j] = adjoint ? -b * md : b * nd;
    im[j] = g * b * (mn - 3.0 * nd * md * inverse * inverse);
  }
}

double static_sum(const PairPoint<double>& point, const PairSources<double>& sources, const double* weight, int total) {
  const PairPoint<double> p = point;
  alignas(64) double r2[kBlock];
  alignas(64) double reciprocal[kBlock];
  double sum = 0.0;
  for (int first = 0; first < total; first += kBlock) {
    const int count = total - first < kBlock ? total - first : kBlock;
    const double* x = sources.x + first;
    const double* y = sources.y + first;
    const double* z = sources.z + first;
    const double* nx = sources.nx + first;
    const double* ny = sources.ny + first;
    const double* nz = sources.nz + first;
    const double* w = weight + first;
    distances(p, x, y, z, count, r2, reciprocal);
    double block = 0.0;
#pragma omp simd reduction(+ : block)
    for (int j = 0; j < count; ++j) {
      const double along = nx[j] * (p.x - x[j]) + ny[j] * (p.y - y[j]) + nz[j] * (p.z - z[j]);
      const double term = w[j] * along * reciprocal[j] * reciprocal[j] * reciprocal[j];
      block += r2[j] > 0.0 ? term : 0.0;
    }
    sum += block;
  }
  return sum;
}

template <typename Real>
constexpr PairLoopTableOf<Real> loops_of() {
  return {pair_values<Real>, add_mutual_sums<Real>, pair_products<Real>};
}

}  // namespace

const PairLoopTable kPairLoops = {loops_of<float>(), loops_of<double>(), static_values, static_sum, near_sources};

}  // namespace touchfield::TOUCHFIELD_LEVEL
