// The loop over transducers for one instruction level: compiled once a level, in a namespace named after it
// (TOUCHFIELD_LEVEL), with rules that let it become SIMD code. No inline function of it may be
// shared with other files: the linker could give them this level's instructions (a test looks for such symbols).
#include <cmath>

#include "sim/acoustics/source_loops.h"
#include "sim/core/sincos.h"

namespace touchfield::TOUCHFIELD_LEVEL {

namespace {

template <typename Real>
constexpr Real kHalfPi = Real(1.57079632679489661923);
template <typename Real>
constexpr Real kOnAxis = sizeof(Real) == 8 ? Real(1e-12) : Real(1e-6);  // [rad]

/// The angle of a cosine c in 0..1, to 2e-16, or what single precision leaves of it: pi/2 - asin c below 1/2, 2 asin
/// sqrt((1 - c) / 2) above, and asin x = x + x R(x^2) on 0..1/2.
/// source   R: the rational approximation of Sun's fdlibm (e_asin.c, 1993)
template <typename Real>
inline Real angle_of(Real c) {
  const bool steep = c < Real(0.5);
  const Real rest = Real(0.5) * (Real(1.0) - c);
  const Real z = steep ? c * c : (rest > Real(0.0) ? rest : Real(0.0));
  const Real x = std::sqrt(z);
  const Real p = z * (Real(1.66666666666666657415e-01) +
                      z * (Real(-3.25565818622400915405e-01) +
                           z * (Real(2.01212532134862925881e-01) +
                                z * (Real(-4.00555345006794114027e-02) +
                                     z * (Real(7.91534994289814532176e-04) + z * Real(3.47933107596021167570e-05))))));
  const Real q = Real(1.0) + z * (Real(-2.40339491173441421878e+00) +
                                  z * (Real(2.02094576023350569471e+00) +
                                       z * (Real(-6.88283971605453293030e-01) + z * Real(7.70381505559019352791e-02))));
  const Real asine = x + x * (p / q);
  return steep ? kHalfPi<Real> - asine : Real(2.0) * asine;
}

template <typename Real, bool kSpline, bool kSlope>
void fill(const SourceWave<Real>& given, const Real* point, const Real* direction, const SourceArrays<Real>& sources,
          int count, Real* values) {
  const SourceWave<Real> wave = given;  // copies that the values cannot alias
  const SourceArrays<Real> s = sources;
  const Real px = point[0];
  const Real py = point[1];
  const Real pz = point[2];
  const Real ux = kSlope ? direction[0] : Real(0.0);
  const Real uy = kSlope ? direction[1] : Real(0.0);
  const Real uz = kSlope ? direction[2] : Real(0.0);
  const Real per_step = kSpline ? Real(1.0) / wave.step : Real(0.0);
  const int last = wave.intervals - 1;
  const Real* const spline = wave.spline;
#pragma omp simd
  for (int n = 0; n < count; ++n) {
    const Real dx = px - s.x[n];
    const Real dy = py - s.y[n];
    const Real dz = pz - s.z[n];
    const Real r = std::sqrt(dx * dx + dy * dy + dz * dz);
    const Real radial = kSlope ? (dx * ux + dy * uy + dz * uz) / r : Real(0.0);
    Real d = Real(1.0);
    Real turned = Real(0.0);  // d' times the angle's derivative
    if constexpr (kSpline) {
      const Real along = (s.axis_x[n] * dx + s.axis_y[n] * dy + s.axis_z[n] * dz) / r;
      const Real theta = angle_of(along < Real(0.0) ? -along : along);
      const int interval = static_cast<int>(theta * per_step);
      const int i = interval < last ? interval : last;
      const Real t = theta - static_cast<Real>(i) * wave.step;
      const int c = 4 * i;
      d = spline[c] + t * (spline[c + 1] + t * (spline[c + 2] + t * spline[c + 3]));
      if constexpr (kSlope) {
        const Real cx = s.axis_y[n] * dz - s.axis_z[n] * dy;
        const Real cy = s.axis_z[n] * dx - s.axis_x[n] * dz;
        const Real cz = s.axis_x[n] * dy - s.axis_y[n] * dx;
        const Real across = std::sqrt(cx * cx + cy * cy + cz * cz);  // r sin(theta)
        const Real slope = spline[c + 1] + t * (Real(2.0) * spline[c + 2] + t * Real(3.0) * spline[c + 3]);
        const Real on_axis = s.axis_x[n] * ux + s.axis_y[n] * uy + s.axis_z[n] * uz;
        const Real share = (along * radial - on_axis) / (across > kOnAxis<Real> * r ? across : Real(1.0));
        turned = across > kOnAxis<Real> * r ? (along < Real(0.0) ? -slope : slope) * share : Real(0.0);
      }
    }
    const Real magnitude = s.amplitude[n] / r;
    const SinCosOf<Real> turn = sincos(wave.k * r);
    // magnitude (real + i imaginary) exp(i k r)
    const Real real = kSlope ? turned - radial * d / r : d;
    const Real imaginary = kSlope ? wave.k * radial * d : Real(0.0);
    values[2 * n] = magnitude * (real * turn.cos - imaginary * turn.sin);
    values[2 * n + 1] = magnitude * (real * turn.sin + imaginary * turn.cos);
  }
}

template <typename Real>
void values_of(const SourceWave<Real>& wave, const Real* point, const Real* direction,
               const SourceArrays<Real>& sources, int count, Real* values) {
  const bool spline = wave.spline != nullptr;
  if (direction == nullptr) {
    spline ? fill<Real, true, false>(wave, point, direction, sources, count, values)
           : fill<Real, false, false>(wave, point, direction, sources, count, values);
  } else {
    spline ? fill<Real, true, true>(wave, point, direction, sources, count, values)
           : fill<Real, false, true>(wave, point, direction, sources, count, values);
  }
}

}  // namespace

const SourceLoops kSourceLoops = {values_of<double>, values_of<float>};

}  // namespace touchfield::TOUCHFIELD_LEVEL
