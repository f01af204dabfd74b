#pragma once

namespace touchfield {

/// Transducers as a structure of arrays, `count` of each.
template <typename Real>
struct SourceArrays {
  const Real* x;  // places [m]
  const Real* y;
  const Real* z;
  const Real* axis_x;  // unit vectors
  const Real* axis_y;
  const Real* axis_z;
  const Real* amplitude;  // [Pa m]
};

/// What all transducers share.
template <typename Real>
struct SourceWave {
  Real k;  // [rad/m]
  const Real*
      spline;  // directivity over the angle: intervals x 4 coefficients of powers of t [rad]; null: 1 everywhere
  int intervals;
  Real step;  // [rad], width of an interval; past intervals * step = pi/2 the directivity is mirrored
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
/// accuracy   1e-14 of the largest amplitude / r (of a derivative k times as much), while k r < 1e5; within 1e-7 rad of
///            an axis d itself is known to no more than 1e-8, since the angle comes from its cosine. In single
///            precision 1e-7 k r + 1e-3 |d'|, while k r < 1e4
template <typename Real>
using SourceLoop = void (*)(const SourceWave<Real>& wave, const Real* point, const Real* direction,
                            const SourceArrays<Real>& sources, int count, Real* values);

/// The loop in both precisions.
struct SourceLoops {
  SourceLoop<double> exact;
  SourceLoop<float> single;
};

/// As source_loops_level.cpp is compiled for each instruction level.
namespace generic {
extern const SourceLoops kSourceLoops;
}  // namespace generic
namespace v2 {
extern const SourceLoops kSourceLoops;
}  // namespace v2
namespace v3 {
extern const SourceLoops kSourceLoops;
}  // namespace v3
namespace v4 {
extern const SourceLoops kSourceLoops;
}  // namespace v4

enum class InstructionLevel;  // its header brings inline functions, which level files must not hold

/// The loops of one level, which the processor must carry out.
const SourceLoops& source_loops(InstructionLevel level);

}  // namespace touchfield
