// The loops of grid_loops.h for one instruction level: compiled once a level, in a namespace named after it
// (TOUCHFIELD_LEVEL), with relaxed floating-point rules, as pair_loops_level.cpp.
#include "sim/bem/grid_formulas.h"
#include "sim/bem/pair_kernel.h"

namespace touchfield::TOUCHFIELD_LEVEL {

// line_loops_level.cpp
void transform_lines(const LinePlan<float>& plan, float* re, float* im, float* work_re, float* work_im);
void transform_lines(const LinePlan<double>& plan, double* re, double* im, double* work_re, double* work_im);

namespace {

/// Weights of the window's points along one axis and their slopes by the place.
template <int kLanes, typename Real>
inline void window_weights(const GridWindow<Real>& window, Real place, Real* weight, Real* slope) {
  const Real t = 2 * place - 1;
  Real w[kLanes];
  Real s[kLanes];
#pragma omp simd
  for (int l = 0; l < kLanes; ++l) {
    w[l] = window.values[l];
    s[l] = 0;
  }
  for (int c = 1; c <= kWindowDegree; ++c) {
#pragma omp simd
    for (int l = 0; l < kLanes; ++l) {
      s[l] = s[l] * t + w[l];
      w[l] = w[l] * t + window.values[c * kLanes + l];
    }
  }
#pragma omp simd
  for (int l = 0; l < kLanes; ++l) {
    weight[l] = w[l];
    slope[l] = 2 * s[l];
  }
}

template <int kLanes, typename Real>
struct FaceWindow {
  alignas(64) Real x[kLanes], y[kLanes], z[kLanes];
  alignas(64) Real dx[kLanes], dy[kLanes], dz[kLanes];  // slopes along the normal

  FaceWindow(const GridWindow<Real>& window, const GridFaces<Real>& faces, int f) {
    window_weights<kLanes>(window, faces.fx[f], x, dx);
    window_weights<kLanes>(window, faces.fy[f], y, dy);
    window_weights<kLanes>(window, faces.fz[f], z, dz);
    for (int l = 0; l < kLanes; ++l) {
      dx[l] *= faces.nx[f];
      dy[l] *= faces.ny[f];
      dz[l] *= faces.nz[f];
    }
  }
};

template <int kLanes, typename Real>
void spread_by(const GridWindow<Real>& window, const GridFaces<Real>& faces, const FaceValues<Real>& values, int first,
               int last, const GridView<Real>& grid) {
  for (int f = first; f < last; ++f) {
    const FaceWindow<kLanes, Real> at(window, faces, f);
    const Real q_re = values.charge_re != nullptr ? values.charge_re[f] : Real(0);
    const Real q_im = values.charge_re != nullptr ? values.charge_im[f] : Real(0);
    const Real d_re = values.dipole_re != nullptr ? values.dipole_re[f] : Real(0);
    const Real d_im = values.dipole_re != nullptr ? values.dipole_im[f] : Real(0);
    for (int ix = 0; ix < window.width; ++ix) {
      for (int iy = 0; iy < window.width; ++iy) {
        const Real weight = at.x[ix] * at.y[iy];
        const Real slope = at.dx[ix] * at.y[iy] + at.x[ix] * at.dy[iy];
        const Real a_re = q_re * weight + d_re * slope;
        const Real a_im = q_im * weight + d_im * slope;
        const Real b_re = d_re * weight;
        const Real b_im = d_im * weight;
        const std::ptrdiff_t start = faces.first[f] + ix * grid.x_stride + iy * grid.y_stride;
        Real* re = grid.re + start;
        Real* im = grid.im + start;
#pragma omp simd
        for (int iz = 0; iz < kLanes; ++iz) {
          re[iz] += a_re * at.z[iz] + b_re * at.dz[iz];
          im[iz] += a_im * at.z[iz] + b_im * at.dz[iz];
        }
      }
    }
  }
}

template <int kLanes, typename Real>
void interpolate_by(const GridWindow<Real>& window, const GridFaces<Real>& faces, const FaceValues<Real>& values,
                    int first, int last, const GridView<Real>& grid) {
  for (int f = first; f < last; ++f) {
    const FaceWindow<kLanes, Real> at(window, faces, f);
    alignas(64) Real w_re[kLanes] = {};  // rows along z, weighted along x and y
    alignas(64) Real w_im[kLanes] = {};
    alignas(64) Real s_re[kLanes] = {};
    alignas(64) Real s_im[kLanes] = {};
    for (int ix = 0; ix < window.width; ++ix) {
      for (int iy = 0; iy < window.width; ++iy) {
        const Real weight = at.x[ix] * at.y[iy];
        const Real slope = at.dx[ix] * at.y[iy] + at.x[ix] * at.dy[iy];
        const std::ptrdiff_t start = faces.first[f] + ix * grid.x_stride + iy * grid.y_stride;
        const Real* re = grid.re + start;
        const Real* im = grid.im + start;
#pragma omp simd
        for (int iz = 0; iz < kLanes; ++iz) {
          w_re[iz] += weight * re[iz];
          w_im[iz] += weight * im[iz];
          s_re[iz] += slope * re[iz];
          s_im[iz] += slope * im[iz];
        }
      }
    }
    Real q_re = 0;
    Real q_im = 0;
    Real d_re = 0;
    Real d_im = 0;
#pragma omp simd reduction(+ : q_re, q_im, d_re, d_im)
    for (int iz = 0; iz < kLanes; ++iz) {
      q_re += at.z[iz] * w_re[iz];
      q_im += at.z[iz] * w_im[iz];
      d_re += at.z[iz] * s_re[iz] + at.dz[iz] * w_re[iz];
      d_im += at.z[iz] * s_im[iz] + at.dz[iz] * w_im[iz];
    }
    if (values.charge_re != nullptr) {
      values.charge_re[f] = q_re;
      values.charge_im[f] = q_im;
    }
    if (values.dipole_re != nullptr) {
      values.dipole_re[f] = d_re;
      values.dipole_im[f] = d_im;
    }
  }
}

template <typename Real>
void spread(const GridWindow<Real>& window, const GridFaces<Real>& faces, const FaceValues<Real>& values, int first,
            int last, const GridView<Real>& grid) {
  window.lanes == 8 ? spread_by<8>(window, faces, values, first, last, grid)
                    : spread_by<16>(window, faces, values, first, last, grid);
}

template <typename Real>
void interpolate(const GridWindow<Real>& window, const GridFaces<Real>& faces, const FaceValues<Real>& values,
                 int first, int last, const GridView<Real>& grid) {
  window.lanes == 8 ? interpolate_by<8>(window, faces, values, first, last, grid)
                    : interpolate_by<16>(window, faces, values, first, last, grid);
}

template <Layer kLayer, bool kDamped, typename Real>
void local_by(const LocalKernel<Real>& kernel, const PairPoint<Real>& at, const PairSources<Real>& sources, int total,
              const Real* value_re, const Real* value_im, int stride, int columns, Real* sum_re, Real* sum_im) {
  constexpr bool kComplex = kDamped || kCharge<kLayer> || kMiller<kLayer>;
  const PairPoint<Real> p = at;
  const LocalKernel<Real> k = kernel;  // a copy that the sums cannot alias
  alignas(64) Real k_re[kPairBlock];
  alignas(64) Real k_im[kPairBlock];
  for (int first = 0; first < total; first += kPairBlock) {
    const int count = total - first < kPairBlock ? total - first : kPairBlock;
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
      const Real r2 = dx * dx + dy * dy + dz * dz;
      const Real root = Real(1) / std::sqrt(r2 + Real(1e-20));
      const Real nd = nx[j] * dx + ny[j] * dy + nz[j] * dz;
      const Real md = p.nx * dx + p.ny * dy + p.nz * dz;
      const Real mn = p.nx * nx[j] + p.ny * ny[j] + p.nz * nz[j];
      Real re;
      Real im;
      local_kernel<kLayer, kDamped>(k, r2, root, nd, md, mn, re, im);
      k_re[j] = re;
      k_im[j] = im;
    }
    for (int s = 0; s < columns; ++s) {
      const Real* v_re = value_re + static_cast<std::ptrdiff_t>(s) * stride + first;
      const Real* v_im = value_im + static_cast<std::ptrdiff_t>(s) * stride + first;
      Real re = 0;
      Real im = 0;
#pragma omp simd reduction(+ : re, im)
      for (int j = 0; j < count; ++j) {
        re += k_re[j] * v_re[j];
        im += k_re[j] * v_im[j];
        if constexpr (kComplex) {
          re -= k_im[j] * v_im[j];
          im += k_im[j] * v_re[j];
        }
      }
      sum_re[s] = first == 0 ? re : sum_re[s] + re;
      sum_im[s] = first == 0 ? im : sum_im[s] + im;
    }
  }
}

template <Layer kLayer, typename Real>
void local_of(const LocalKernel<Real>& kernel, const PairPoint<Real>& point, const PairSources<Real>& sources,
              int count, const Real* value_re, const Real* value_im, int stride, int columns, Real* sum_re,
              Real* sum_im) {
  kernel.damped
      ? local_by<kLayer, true>(kernel, point, sources, count, value_re, value_im, stride, columns, sum_re, sum_im)
      : local_by<kLayer, false>(kernel, point, sources, count, value_re, value_im, stride, columns, sum_re, sum_im);
}

template <typename Real>
void local(Layer layer, const LocalKernel<Real>& kernel, const PairPoint<Real>& point, const PairSources<Real>& sources,
           int count, const Real* value_re, const Real* value_im, int stride, int columns, Real* sum_re, Real* sum_im) {
  using Loop = void (*)(const LocalKernel<Real>&, const PairPoint<Real>&, const PairSources<Real>&, int, const Real*,
                        const Real*, int, int, Real*, Real*);
  static constexpr Loop kLoops[] = {local_of<Layer::kSingle, Real>,        local_of<Layer::kDouble, Real>,
                                    local_of<Layer::kAdjoint, Real>,       local_of<Layer::kBurtonMiller, Real>,
                                    local_of<Layer::kAdjointMiller, Real>, local_of<Layer::kSingleAdjoint, Real>};
  kLoops[static_cast<int>(layer)](kernel, point, sources, count, value_re, value_im, stride, columns, sum_re, sum_im);
}

template <typename Real>
constexpr GridLoopTableOf<Real> loops_of() {
  return {transform_lines, spread<Real>, interpolate<Real>, local<Real>};
}

}  // namespace

const GridLoopTable kGridLoops = {loops_of<float>(), loops_of<double>()};

}  // namespace touchfield::TOUCHFIELD_LEVEL
