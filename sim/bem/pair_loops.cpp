// Compiled with relaxed floating-point rules, so that its loops become SIMD code: it includes nothing whose inline
// functions other files share.
#include "sim/bem/pair_loops.h"

#include <algorithm>
#include <cmath>

#include "sim/bem/pair_kernel.h"
#include "sim/bem/reciprocal_root.h"

namespace touchfield {

namespace {

constexpr int kBlock = 256;  // sources a pass: distances stay in the first cache

template <Layer kLayer, bool kDamped, typename Real>
void fill(const PairConstants<Real>& given, const PairPoint<Real>& at, const PairSources<Real>& sources, int total,
          Real* re, Real* im) {
  const PairConstants<Real> constants = given;  // copies that re and im cannot alias
  const PairPoint<Real> p = at;
  alignas(64) Real r2[kBlock];
  alignas(64) Real reciprocal[kBlock];
  for (int first = 0; first < total; first += kBlock) {
    const int count = std::min(kBlock, total - first);
    const Real* x = sources.x + first;
    const Real* y = sources.y + first;
    const Real* z = sources.z + first;
    const Real* nx = sources.nx + first;
    const Real* ny = sources.ny + first;
    const Real* nz = sources.nz + first;
#pragma omp simd
    for (int j = 0; j < count; ++j) {
      const Real dx = p.x - x[j];
      const Real dy = p.y - y[j];
      const Real dz = p.z - z[j];
      r2[j] = dx * dx + dy * dy + dz * dz;
    }
    reciprocal_roots(r2, count, reciprocal);
#pragma omp simd
    for (int j = 0; j < count; ++j) {
      pair_kernel<kLayer, kDamped>(constants, r2[j], reciprocal[j], p.x - x[j], p.y - y[j], p.z - z[j], p.nx, p.ny,
                                   p.nz, nx[j], ny[j], nz[j], re[first + j], im[first + j]);
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

}  // namespace

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

template void pair_values<float>(Layer, const PairConstants<float>&, const PairPoint<float>&, const PairSources<float>&,
                                 int, float*, float*);
template void pair_values<double>(Layer, const PairConstants<double>&, const PairPoint<double>&,
                                  const PairSources<double>&, int, double*, double*);

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
    const int count = std::min(kBlock, total - first);
    const double* x = sources.x + first;
    const double* y = sources.y + first;
    const double* z = sources.z + first;
    const double* nx = sources.nx + first;
    const double* ny = sources.ny + first;
    const double* nz = sources.nz + first;
    const double* w = weight + first;
#pragma omp simd
    for (int j = 0; j < count; ++j) {
      const double dx = p.x - x[j];
      const double dy = p.y - y[j];
      const double dz = p.z - z[j];
      r2[j] = dx * dx + dy * dy + dz * dz;
    }
    reciprocal_roots(r2, count, reciprocal);
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

int near_sources(const PairPoint<double>& point, const PairSources<double>& sources, const double* reach_squared,
                 int total, int* near) {
  const PairPoint<double> p = point;
  unsigned char inside[kBlock];
  int found = 0;
  for (int first = 0; first < total; first += kBlock) {
    const int count = std::min(kBlock, total - first);
    const double* x = sources.x + first;
    const double* y = sources.y + first;
    const double* z = sources.z + first;
    const double* reach = reach_squared + first;
    int any = 0;
#pragma omp simd reduction(+ : any)
    for (int j = 0; j < count; ++j) {
      const double dx = p.x - x[j];
      const double dy = p.y - y[j];
      const double dz = p.z - z[j];
      const int hit = dx * dx + dy * dy + dz * dz < reach[j] ? 1 : 0;
      inside[j] = static_cast<unsigned char>(hit);
      any += hit;
    }
    for (int j = 0; any > 0 && j < count; ++j) {
      near[found] = first + j;
      found += inside[j];
      any -= inside[j];
    }
  }
  return found;
}

}  // namespace touchfield
