#include "sim/acoustics/directivity.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include "sim/core/errors.h"

namespace touchfield {

namespace {

constexpr int kNodes = 10;
// At 0, 10, ... 90 degrees. Source: the AUTD3 library's directivity of the T4010A1.
constexpr std::array<double, kNodes> kT4010a1 = {1.0,         1.0,         1.0,         0.891250938, 0.707945784,
                                                 0.501187234, 0.354813389, 0.251188643, 0.199526231, 0.177827941};

/// Second derivatives at equally spaced nodes of the natural cubic spline, by the Thomas algorithm.
std::array<double, kNodes> natural_spline_curvatures(const std::array<double, kNodes>& y, double step) {
  std::array<double, kNodes> m{};
  std::array<double, kNodes> c{};
  std::array<double, kNodes> d{};
  for (int i = 1; i < kNodes - 1; ++i) {
    const double pivot = 4.0 - c[i - 1];
    c[i] = 1.0 / pivot;
    d[i] = (6.0 * (y[i + 1] - 2.0 * y[i] + y[i - 1]) / (step * step) - d[i - 1]) / pivot;
  }
  for (int i = kNodes - 2; i >= 1; --i) {
    m[i] = d[i] - c[i] * m[i + 1];
  }
  return m;
}

/// POSIX's j1 and jn: ten times as fast as std::cyl_bessel_j.
double piston_value(double x) { return x < 1e-4 ? 1.0 - x * x / 8.0 : 2.0 * ::j1(x) / x; }

}  // namespace

Directivity::Directivity(Kind kind, double ka) : kind_(kind), ka_(ka) {
  if (kind_ != Kind::kT4010a1) {
    return;
  }
  const auto m = natural_spline_curvatures(kT4010a1, kInterval);
  for (int i = 0; i < kIntervals; ++i) {
    const double slope = (kT4010a1[i + 1] - kT4010a1[i]) / kInterval - kInterval * (2.0 * m[i] + m[i + 1]) / 6.0;
    spline_[i] = {kT4010a1[i], slope, 0.5 * m[i], (m[i + 1] - m[i]) / (6.0 * kInterval)};
  }
}

Directivity Directivity::omni() { return Directivity(Kind::kOmni); }

Directivity Directivity::piston(double k, double radius) {
  if (!(k > 0) || !(radius > 0)) {
    throw InputError(fmt::format("piston: k = {} and radius = {} m must be > 0", k, radius));
  }
  return Directivity(Kind::kPiston, k * radius);
}

Directivity Directivity::t4010a1() { return Directivity(Kind::kT4010a1); }

double Directivity::value(double cos_theta) const {
  if (kind_ == Kind::kOmni) {
    return 1.0;
  }
  const double cosine = std::clamp(cos_theta, -1.0, 1.0);
  // Without the slope and the angle a piston takes a third of the time.
  return kind_ == Kind::kPiston ? piston_value(ka_ * std::sqrt(1.0 - cosine * cosine)) : at(std::acos(cosine)).value;
}

DirectivityValue Directivity::at(double theta) const {
  switch (kind_) {
    case Kind::kOmni:
      return {1.0, 0.0};
    case Kind::kPiston: {
      const double x = ka_ * std::sin(theta);
      if (x < 1e-4) {  // the series' next terms are below 1e-17 and 1e-13
        return {piston_value(x), -0.25 * x * ka_ * std::cos(theta)};
      }
      return {piston_value(x), -2.0 * ::jn(2, x) / x * ka_ * std::cos(theta)};
    }
    case Kind::kT4010a1: {
      const bool mirrored = theta > 0.5 * std::numbers::pi;
      const double angle = mirrored ? std::numbers::pi - theta : theta;
      const int i = std::clamp(static_cast<int>(angle / kInterval), 0, kIntervals - 1);
      const double t = angle - i * kInterval;
      const auto& c = spline_[static_cast<std::size_t>(i)];
      const double slope = c[1] + t * (2.0 * c[2] + t * 3.0 * c[3]);
      return {c[0] + t * (c[1] + t * (c[2] + t * c[3])), mirrored ? -slope : slope};
    }
  }
  return {1.0, 0.0};
}

}  // namespace touchfield
