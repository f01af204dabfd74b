#include "sim/bem/rigid_sphere.h"

#include <cmath>
#include <numbers>
#include <vector>

#include "sim/core/require.h"

namespace touchfield {

namespace {

/// h_0 ... h_order at x: spherical Hankel functions of the first kind.
std::vector<Complex> spherical_hankel(int order, double x) {
  std::vector<Complex> h;
  for (int n = 0; n <= order; ++n) {
    const auto degree = static_cast<unsigned>(n);
    h.emplace_back(std::sph_bessel(degree, x), std::sph_neumann(degree, x));
  }
  return h;
}

/// Beyond, the terms of a plane wave vanish.
int highest_order(double ka) { return static_cast<int>(std::ceil(ka + 10.0 + 6.0 * std::cbrt(ka))); }

/// i / (x^2 h_n'(x)) with h_n' = n/x h_n - h_(n+1).
Complex surface_factor(const std::vector<Complex>& h, int n, double x) {
  const auto at = static_cast<std::size_t>(n);
  return Complex(0, 1) / (x * x * (static_cast<double>(n) / x * h[at] - h[at + 1]));
}

void require_sphere(const Wave& wave, double radius) {
  require(radius > 0, "rigid sphere: radius = {} m must be > 0", radius);
  require(wave.medium().absorption == 0, "rigid sphere: the series holds for a medium without absorption");
}

/// sum_n (2n+1) c_n P_n(cos theta).
Eigen::VectorXcd legendre_sum(const std::vector<Complex>& c, const Eigen::VectorXd& cos_theta) {
  Eigen::VectorXcd sum = Eigen::VectorXcd::Zero(cos_theta.size());
  for (Eigen::Index i = 0; i < cos_theta.size(); ++i) {
    double previous = 0.0;
    double p = 1.0;
    for (std::size_t n = 0; n < c.size(); ++n) {
      const auto degree = static_cast<double>(n);
      sum(i) += (2.0 * degree + 1.0) * c[n] * p;
      const double next = ((2.0 * degree + 1.0) * cos_theta(i) * p - degree * previous) / (degree + 1.0);
      previous = p;
      p = next;
    }
  }
  return sum;
}

}  // namespace

Eigen::VectorXcd rigid_sphere_plane_wave(const Wave& wave, double radius, const Eigen::VectorXd& cos_theta) {
  require_sphere(wave, radius);
  const double ka = wave.k() * radius;
  const int order = highest_order(ka);
  const auto h = spherical_hankel(order + 1, ka);
  std::vector<Complex> c;
  Complex power = 1.0;  // i^n
  for (int n = 0; n <= order; ++n) {
    c.push_back(power * surface_factor(h, n, ka));
    power *= Complex(0, 1);
  }
  return legendre_sum(c, cos_theta);
}

Eigen::VectorXcd rigid_sphere_point_source(const Wave& wave, double radius, double source_distance,
                                           const Eigen::VectorXd& cos_theta) {
  require_sphere(wave, radius);
  // Nearer, the terms vanish so slowly that h_n(ka) overflows first.
  require(source_distance >= 1.5 * radius, "rigid sphere: source_distance = {} m must be >= 1.5 radii of {} m",
          source_distance, radius);
  const double ka = wave.k() * radius;
  const double kr = wave.k() * source_distance;
  // Beyond, the standard library's spherical Bessel functions do not converge.
  require(kr <= 1e4, "rigid sphere: k source_distance = {} must be <= 1e4", kr);
  // Beyond n ~ kr the terms fall off as (a / r0)^n.
  const double tail = 23.0 / std::log(source_distance / radius);
  const int order = static_cast<int>(std::ceil(ka + 10.0 + 6.0 * std::cbrt(ka) + tail));
  const auto near = spherical_hankel(order + 1, ka);
  const auto far = spherical_hankel(order, kr);
  std::vector<Complex> c;
  for (int n = 0; n <= order; ++n) {
    const Complex term = far[static_cast<std::size_t>(n)] * surface_factor(near, n, ka);
    if (!std::isfinite(term.real()) || !std::isfinite(term.imag())) {
      break;  // h_n(ka) overflows long after the terms have vanished
    }
    c.push_back(Complex(0, wave.k() / (4.0 * std::numbers::pi)) * term);
  }
  return legendre_sum(c, cos_theta);
}

double rigid_sphere_force(const Wave& wave, double radius, double amplitude) {
  require_sphere(wave, radius);
  const double ka = wave.k() * radius;
  const int order = highest_order(ka);
  const auto h = spherical_hankel(order + 2, ka);
  const auto scattered = [&](int n) {  // s_n
    const Complex slope =
        static_cast<double>(n) / ka * h[static_cast<std::size_t>(n)] - h[static_cast<std::size_t>(n) + 1];
    return -slope.real() / slope;
  };
  double sum = 0.0;
  for (int n = 0; n <= order; ++n) {
    const Complex here = scattered(n);
    const Complex next = scattered(n + 1);
    sum += (n + 1.0) * (here + next + 2.0 * here * std::conj(next)).real();
  }
  const Medium& medium = wave.medium();
  const double energy_density =
      amplitude * amplitude / (2.0 * medium.density * medium.sound_speed * medium.sound_speed);
  return -4.0 / (ka * ka) * sum * std::numbers::pi * radius * radius * energy_density;
}

}  // namespace touchfield
