#pragma once

namespace touchfield {

/// Transducers as a structure of arrays, `count` of each.
struct SourceArrays {
  const double* x;  // places [m]
  const double* y;
  const double* z;
  const double* axis_x;  // unit vectors
  const double* axis_y;
  const double* axis_z;
  const double* amplitude;  // [Pa m]
};

/// What all transducers share.
struct SourceWave {
  double k;  // [rad/m]
  const double*
      spline;  // directivity over the angle: intervals x 4 coefficients of powers of t [rad]; null: 1 everywhere
  int intervals;
  double step;  // [rad], width of an interval; past intervals * step = pi/2 the directivity is mirrored
};

/// Pressures of transducers at unit drive at a point, without absorption:
///
///   values[2n] + i values[2n + 1] = amplitude_n d(theta_n) exp(i k r_n) / r_n
///
/// or, with a direction u (a unit vector; null without), their derivatives along it, d' = dd / dtheta and rho the unit
/// vector from the transducer to the point:
///
///   amplitude_n exp(i k r) / r ((i k - 1 / r) (rho.u) d + d' (cos(theta) rho - axis).u / (r sin(theta)))
///
/// without the term of d' on the axis, where its mean over all sides is 0.
///
/// accuracy   1e-14 of the largest amplitude / r (of a derivative k times as much), while k r < 1e5; within 1e-7 rad of an
///            axis d itself is known to no more than 1e-8, since the angle comes from its cosine
using SourceLoop = void (*)(const SourceWave& wave, const double* point, const double* direction,
                            const SourceArrays& sources, int count, double* values);

/// As source_loops_level.cpp is compiled for each instruction level.
namespace generic {
extern const SourceLoop kSourceLoop;
}  // namespace generic
namespace v2 {
extern const SourceLoop kSourceLoop;
}  // namespace v2
namespace v3 {
extern const SourceLoop kSourceLoop;
}  // namespace v3
namespace v4 {
extern const SourceLoop kSourceLoop;
}  // namespace v4

enum class InstructionLevel;  // its header brings inline functions, which level files must not hold

/// The loop of one level, which the processor must carry out.
SourceLoop source_loop(InstructionLevel level);

}  // namespace touchfield
