// The transforms of grid_loops.h for one instruction level: compiled once a level like grid_loops_level.cpp.
#include "sim/bem/grid_loops.h"

namespace touchfield::TOUCHFIELD_LEVEL {

namespace {

/// Stages by Stockham: the numbers of a transform of n points lie `stride` apart, those of each line of `block`
/// transforms side by side. Stage by stage n shrinks by the radix and the stride grows by it.
template <typename Real>
struct Stage {
  const LinePlan<Real>& plan;
  int n;       // of the transforms left
  int stride;  // transforms side by side

  int block() const { return stride * kGridLanes<Real>; }
  /// exp(-2 pi i p j / n) by parts.
  Real cosine(int p, int j) const { return plan.cos[p * j * stride % plan.n]; }
  Real sine(int p, int j) const { return -plan.sin[p * j * stride % plan.n]; }
};

template <typename Real>
void stage_of_two(const Stage<Real>& stage, const Real* x_re, const Real* x_im, Real* y_re, Real* y_im) {
  const int m = stage.n / 2;
  const int block = stage.block();
  for (int p = 0; p < m; ++p) {
    const Real c = stage.cosine(p, 1);
    const Real s = stage.sine(p, 1);
    const Real* a_re = x_re + p * block;
    const Real* a_im = x_im + p * block;
    const Real* b_re = a_re + m * block;
    const Real* b_im = a_im + m * block;
    Real* u_re = y_re + 2 * p * block;
    Real* u_im = y_im + 2 * p * block;
    Real* v_re = u_re + block;
    Real* v_im = u_im + block;
#pragma omp simd
    for (int q = 0; q < block; ++q) {
      const Real d_re = a_re[q] - b_re[q];
      const Real d_im = a_im[q] - b_im[q];
      u_re[q] = a_re[q] + b_re[q];
      u_im[q] = a_im[q] + b_im[q];
      v_re[q] = c * d_re - s * d_im;
      v_im[q] = c * d_im + s * d_re;
    }
  }
}

template <typename Real>
void stage_of_three(const Stage<Real>& stage, const Real* x_re, const Real* x_im, Real* y_re, Real* y_im) {
  constexpr Real kSine = static_cast<Real>(0.86602540378443864676);
  const int m = stage.n / 3;
  const int block = stage.block();
  for (int p = 0; p < m; ++p) {
    const Real c1 = stage.cosine(p, 1);
    const Real s1 = stage.sine(p, 1);
    const Real c2 = stage.cosine(p, 2);
    const Real s2 = stage.sine(p, 2);
    const Real* a_re = x_re + p * block;
    const Real* a_im = x_im + p * block;
    const int step = m * block;
    Real* u_re = y_re + 3 * p * block;
    Real* u_im = y_im + 3 * p * block;
#pragma omp simd
    for (int q = 0; q < block; ++q) {
      const Real t_re = a_re[q + step] + a_re[q + 2 * step];
      const Real t_im = a_im[q + step] + a_im[q + 2 * step];
      const Real m_re = a_re[q] - Real(0.5) * t_re;
      const Real m_im = a_im[q] - Real(0.5) * t_im;
      const Real d_re = kSine * (a_im[q + step] - a_im[q + 2 * step]);  // -i sin (b - c)
      const Real d_im = -kSine * (a_re[q + step] - a_re[q + 2 * step]);
      u_re[q] = a_re[q] + t_re;
      u_im[q] = a_im[q] + t_im;
      const Real f_re = m_re + d_re;
      const Real f_im = m_im + d_im;
      const Real g_re = m_re - d_re;
      const Real g_im = m_im - d_im;
      u_re[q + block] = c1 * f_re - s1 * f_im;
      u_im[q + block] = c1 * f_im + s1 * f_re;
      u_re[q + 2 * block] = c2 * g_re - s2 * g_im;
      u_im[q + 2 * block] = c2 * g_im + s2 * g_re;
    }
  }
}

template <typename Real>
void stage_of_four(const Stage<Real>& stage, const Real* x_re, const Real* x_im, Real* y_re, Real* y_im) {
  const int m = stage.n / 4;
  const int block = stage.block();
  for (int p = 0; p < m; ++p) {
    const Real c1 = stage.cosine(p, 1);
    const Real s1 = stage.sine(p, 1);
    const Real c2 = stage.cosine(p, 2);
    const Real s2 = stage.sine(p, 2);
    const Real c3 = stage.cosine(p, 3);
    const Real s3 = stage.sine(p, 3);
    const Real* a_re = x_re + p * block;
    const Real* a_im = x_im + p * block;
    const int step = m * block;
    Real* u_re = y_re + 4 * p * block;
    Real* u_im = y_im + 4 * p * block;
#pragma omp simd
    for (int q = 0; q < block; ++q) {
      const Real ac_re = a_re[q] + a_re[q + 2 * step];
      const Real ac_im = a_im[q] + a_im[q + 2 * step];
      const Real am_re = a_re[q] - a_re[q + 2 * step];
      const Real am_im = a_im[q] - a_im[q + 2 * step];
      const Real bd_re = a_re[q + step] + a_re[q + 3 * step];
      const Real bd_im = a_im[q + step] + a_im[q + 3 * step];
      const Real bm_re = a_im[q + step] - a_im[q + 3 * step];  // -i (b - d)
      const Real bm_im = a_re[q + 3 * step] - a_re[q + step];
      u_re[q] = ac_re + bd_re;
      u_im[q] = ac_im + bd_im;
      const Real f_re = am_re + bm_re;
      const Real f_im = am_im + bm_im;
      const Real g_re = ac_re - bd_re;
      const Real g_im = ac_im - bd_im;
      const Real h_re = am_re - bm_re;
      const Real h_im = am_im - bm_im;
      u_re[q + block] = c1 * f_re - s1 * f_im;
      u_im[q + block] = c1 * f_im + s1 * f_re;
      u_re[q + 2 * block] = c2 * g_re - s2 * g_im;
      u_im[q + 2 * block] = c2 * g_im + s2 * g_re;
      u_re[q + 3 * block] = c3 * h_re - s3 * h_im;
      u_im[q + 3 * block] = c3 * h_im + s3 * h_re;
    }
  }
}

template <typename Real>
void stage_of_five(const Stage<Real>& stage, const Real* x_re, const Real* x_im, Real* y_re, Real* y_im) {
  constexpr Real kCos1 = static_cast<Real>(0.30901699437494742410);
  constexpr Real kSin1 = static_cast<Real>(0.95105651629515357212);
  constexpr Real kCos2 = static_cast<Real>(-0.80901699437494742410);
  constexpr Real kSin2 = static_cast<Real>(0.58778525229247312917);
  const int m = stage.n / 5;
  const int block = stage.block();
  for (int p = 0; p < m; ++p) {
    Real c[5];
    Real s[5];
    for (int j = 1; j < 5; ++j) {
      c[j] = stage.cosine(p, j);
      s[j] = stage.sine(p, j);
    }
    const Real* a_re = x_re + p * block;
    const Real* a_im = x_im + p * block;
    const int step = m * block;
    Real* u_re = y_re + 5 * p * block;
    Real* u_im = y_im + 5 * p * block;
#pragma omp simd
    for (int q = 0; q < block; ++q) {
      const Real be_re = a_re[q + step] + a_re[q + 4 * step];
      const Real be_im = a_im[q + step] + a_im[q + 4 * step];
      const Real bm_re = a_re[q + step] - a_re[q + 4 * step];
      const Real bm_im = a_im[q + step] - a_im[q + 4 * step];
      const Real cd_re = a_re[q + 2 * step] + a_re[q + 3 * step];
      const Real cd_im = a_im[q + 2 * step] + a_im[q + 3 * step];
      const Real cm_re = a_re[q + 2 * step] - a_re[q + 3 * step];
      const Real cm_im = a_im[q + 2 * step] - a_im[q + 3 * step];
      const Real p_re = a_re[q] + kCos1 * be_re + kCos2 * cd_re;
      const Real p_im = a_im[q] + kCos1 * be_im + kCos2 * cd_im;
      const Real r_re = a_re[q] + kCos2 * be_re + kCos1 * cd_re;
      const Real r_im = a_im[q] + kCos2 * be_im + kCos1 * cd_im;
      const Real g_re = kSin1 * bm_im + kSin2 * cm_im;  // -i (..)
      const Real g_im = -(kSin1 * bm_re + kSin2 * cm_re);
      const Real h_re = kSin2 * bm_im - kSin1 * cm_im;
      const Real h_im = -(kSin2 * bm_re - kSin1 * cm_re);
      u_re[q] = a_re[q] + be_re + cd_re;
      u_im[q] = a_im[q] + be_im + cd_im;
      u_re[q + block] = c[1] * (p_re + g_re) - s[1] * (p_im + g_im);
      u_im[q + block] = c[1] * (p_im + g_im) + s[1] * (p_re + g_re);
      u_re[q + 2 * block] = c[2] * (r_re + h_re) - s[2] * (r_im + h_im);
      u_im[q + 2 * block] = c[2] * (r_im + h_im) + s[2] * (r_re + h_re);
      u_re[q + 3 * block] = c[3] * (r_re - h_re) - s[3] * (r_im - h_im);
      u_im[q + 3 * block] = c[3] * (r_im - h_im) + s[3] * (r_re - h_re);
      u_re[q + 4 * block] = c[4] * (p_re - g_re) - s[4] * (p_im - g_im);
      u_im[q + 4 * block] = c[4] * (p_im - g_im) + s[4] * (p_re - g_re);
    }
  }
}

template <typename Real>
void transform(const LinePlan<Real>& plan, Real* re, Real* im, Real* work_re, Real* work_im) {
  Real* from_re = re;
  Real* from_im = im;
  Real* to_re = work_re;
  Real* to_im = work_im;
  int left = plan.n;
  for (int i = 0; i < plan.stages; ++i) {
    const int radix = plan.radix[i];
    const Stage<Real> stage{plan, left, plan.n / left};
    if (radix == 4) {
      stage_of_four(stage, from_re, from_im, to_re, to_im);
    } else if (radix == 2) {
      stage_of_two(stage, from_re, from_im, to_re, to_im);
    } else if (radix == 3) {
      stage_of_three(stage, from_re, from_im, to_re, to_im);
    } else {
      stage_of_five(stage, from_re, from_im, to_re, to_im);
    }
    left /= radix;
    Real* swap = from_re;
    from_re = to_re;
    to_re = swap;
    swap = from_im;
    from_im = to_im;
    to_im = swap;
  }
  if (from_re != re) {
    const int total = plan.n * kGridLanes<Real>;
#pragma omp simd
    for (int i = 0; i < total; ++i) {
      re[i] = from_re[i];
      im[i] = from_im[i];
    }
  }
}

}  // namespace

void transform_lines(const LinePlan<float>& plan, float* re, float* im, float* work_re, float* work_im) {
  transform(plan, re, im, work_re, work_im);
}

void transform_lines(const LinePlan<double>& plan, double* re, double* im, double* work_re, double* work_im) {
  transform(plan, re, im, work_re, work_im);
}

}  // namespace touchfield::TOUCHFIELD_LEVEL
