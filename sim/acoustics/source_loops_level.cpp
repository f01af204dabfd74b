// The loop over transducers for one instruction level: compiled once a level, in a namespace named after it
// (TOUCHFIELD_LEVEL), with rules that let it become SIMD code. No inline function of it may be
// shared with other files: the linker could give them this level's instructions (a test looks for such symbols).
#include <cmath>

#include "sim/acoustics/source_loops.h"
#include "sim/core/sincos.h"

namespace touchfield::TOUCHFIELD_LEVEL {

namespace {

constexpr double kHalfPi = 1.57079632679489661923;
constexpr double kOnAxis = 1e-12;  // [rad]

/// The angle of a cosine c in 0..1, to 2e-16: pi/2 - asin c below 1/2, 2 asin sqrt((1 - c) / 2) above, and
/// asin x = x + x R(x^2) on 0..1/2.
/// source   R: the rational approximation of Sun's fdlibm (e_asin.c, 1993)
inline double angle_of(double c) {
  const bool steep = c < 0.5;
  const double rest = 0.5 * (1.0 - c);
  const double z = steep ? c * c : (rest > 0.0 ? rest : 0.0);
  const double x = std::sqrt(z);
  const double p = z * (1.66666666666666657415e-01 +
                        z * (-3.25565818622400915405e-01 +
                             z * (2.01212532134862925881e-01 +
                                  z * (-4.00555345006794114027e-02 +
                                       z * (7.91534994289814532176e-04 + z * 3.47933107596021167570e-05)))));
  const double q =
      1.0 + z * (-2.40339491173441421878e+00 +
                 z * (2.02094576023350569471e+00 + z * (-6.88283971605453293030e-01 + z * 7.70381505559019352791e-02)));
  const double asine = x + x * (p / q);
  return steep ? kHalfPi - asine : 2.0 * asine;
}

template <bool kSpline, bool kSlope>
void fill(const SourceWave& given, const double* point, const double* direction, const SourceArrays& sources, int count,
          double* values) {
  const SourceWave wave = given;  // copies that the values cannot alias
  const SourceArrays s = sources;
  const double px = point[0];
  const double py = point[1];
  const double pz = point[2];
  const double ux = kSlope ? direction[0] : 0.0;
  const double uy = kSlope ? direction[1] : 0.0;
  const double uz = kSlope ? direction[2] : 0.0;
  const double per_step = kSpline ? 1.0 / wave.step : 0.0;
  const int last = wave.intervals - 1;
  const double* const spline = wave.spline;
#pragma omp simd
  for (int n = 0; n < count; ++n) {
    const double dx = px - s.x[n];
    const double dy = py - s.y[n];
    const double dz = pz - s.z[n];
    const double r = std::sqrt(dx * dx + dy * dy + dz * dz);
    const double radial = kSlope ? (dx * ux + dy * uy + dz * uz) / r : 0.0;
    double d = 1.0;
    double turned = 0.0;  // d' times the angle's derivative
    if constexpr (kSpline) {
      const double along = (s.axis_x[n] * dx + s.axis_y[n] * dy + s.axis_z[n] * dz) / r;
      const double theta = angle_of(along < 0.0 ? -along : along);
      const int interval = static_cast<int>(theta * per_step);
      const int i = interval < last ? interval : last;
      const double t = theta - i * wave.step;
      const int c = 4 * i;
      d = spline[c] + t * (spline[c + 1] + t * (spline[c + 2] + t * spline[c + 3]));
      if constexpr (kSlope) {
        const double cx = s.axis_y[n] * dz - s.axis_z[n] * dy;
        const double cy = s.axis_z[n] * dx - s.axis_x[n] * dz;
        const double cz = s.axis_x[n] * dy - s.axis_y[n] * dx;
        const double across = std::sqrt(cx * cx + cy * cy + cz * cz);  // r sin(theta)
        const double slope = spline[c + 1] + t * (2.0 * spline[c + 2] + t * 3.0 * spline[c + 3]);
        const double on_axis = s.axis_x[n] * ux + s.axis_y[n] * uy + s.axis_z[n] * uz;
        const double share = (along * radial - on_axis) / (across > kOnAxis * r ? across : 1.0);
        turned = across > kOnAxis * r ? (along < 0.0 ? -slope : slope) * share : 0.0;
      }
    }
    const double magnitude = s.amplitude[n] / r;
    const SinCos turn = sincos(wave.k * r);
    // magnitude (real + i imaginary) exp(i k r)
    const double real = kSlope ? turned - radial * d / r : d;
    const double imaginary = kSlope ? wave.k * radial * d : 0.0;
    values[2 * n] = magnitude * (real * turn.cos - imaginary * turn.sin);
    values[2 * n + 1] = magnitude * (real * turn.sin + imaginary * turn.cos);
  }
}

void values_of(const SourceWave& wave, const double* point, const double* direction, const SourceArrays& sources,
               int count, double* values) {
  const bool spline = wave.spline != nullptr;
  if (direction == nullptr) {
    spline ? fill<true, false>(wave, point, direction, sources, count, values)
           : fill<false, false>(wave, point, direction, sources, count, values);
  } else {
    spline ? fill<true, true>(wave, point, direction, sources, count, values)
           : fill<false, true>(wave, point, direction, sources, count, values);
  }
}

}  // namespace

const SourceLoop kSourceLoop = values_of;

}  // namespace touchfield::TOUCHFIELD_LEVEL
