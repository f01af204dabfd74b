#pragma once

#include <array>

#include "sim/core/units.h"

namespace touchfield {

/// Directivity and its slope at one angle.
struct DirectivityValue {
  double value;
  double slope;  // d value / d theta [1/rad]
};

/// How strongly a transducer radiates at an angle from its axis, relative to the axis.
///
///   omni      1
///   piston    2 J1(x)/x, x = k b sin(theta), b the radius
///   t4010a1   natural cubic spline in theta through measured values at 0, 10, ... 90 degrees, mirrored past 90
///
/// source: t4010a1: the AUTD3 library's table for that transducer
class Directivity {
 public:
  enum class Kind { kOmni, kPiston, kT4010a1 };

  static Directivity omni();
  /// k [rad/m] and radius b [m], both > 0; throws InputError otherwise
  static Directivity piston(double k, double radius);
  static Directivity t4010a1();

  Kind kind() const { return kind_; }
  /// k b of a piston.
  double ka() const { return ka_; }

  /// cos_theta in -1..1 (values beyond by rounding are clamped).
  double value(double cos_theta) const;
  /// theta in 0..pi.
  DirectivityValue at(double theta) const;

  static constexpr int kIntervals = 9;  // of t4010a1, each kInterval wide
  static constexpr double kInterval = 10.0 * kDegree;
  /// Its pieces, kIntervals x {c0, c1, c2, c3} of c0 + c1 t + c2 t^2 + c3 t^3, t in rad from the interval's begin; null
  /// for the other kinds.
  const double* spline() const { return kind_ == Kind::kT4010a1 ? spline_.front().data() : nullptr; }

 private:
  explicit Directivity(Kind kind, double ka = 0.0);

  Kind kind_;
  double ka_;  // k b of a piston
  std::array<std::array<double, 4>, kIntervals> spline_{};
};

}  // namespace touchfield
