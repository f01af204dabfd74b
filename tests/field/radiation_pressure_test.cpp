// The radiation pressure of each face of a rigid sphere against the series, and its figures on patterns.
#include <cmath>

#include "sim/field/metrics.h"
#include "tests/support/sphere_support.h"
#include "tests/support/testing.h"

namespace touchfield::radiation_pressure_test {

/// Pressure on a rigid sphere in a plane wave of 1 Pa along +z, and its slope along the meridian over the radius. It is
/// summed here, apart from the program's series: derivatives of the spherical functions and of P_n by recurrences.
struct SeriesPoint {
  Complex pressure;
  Complex slope;  // dp/dtheta / a [Pa/m]
};

SeriesPoint series_at(double ka, double radius, double cosine) {
  const auto hankel = [&](unsigned n) { return Complex(std::sph_bessel(n, ka), std::sph_neumann(n, ka)); };
  const double sine = std::sqrt(1.0 - cosine * cosine);
  SeriesPoint sum = {};
  Complex power = 1.0;  // i^n
  double before = 0.0;  // P_(n-1)
  double here = 1.0;    // P_n
  for (unsigned n = 0; n < 45; ++n) {
    const double degree = n;
    const Complex h_slope = (n == 0 ? Complex(0) : hankel(n - 1)) - (degree + 1.0) / ka * hankel(n);
    const Complex factor = (2.0 * degree + 1.0) * power * Complex(0, 1) / (ka * ka * (n == 0 ? -hankel(1) : h_slope));
    sum.pressure += factor * here;
    // dP_n/dtheta = n (cos P_n - P_(n-1)) / sin
    sum.slope += factor * degree * (cosine * here - before) / (sine * radius);
    const double next = ((2.0 * degree + 1.0) * cosine * here - degree * before) / (degree + 1.0);
    before = here;
    here = next;
    power *= Complex(0, 1);
  }
  return sum;
}

/// P at the direction of every face from the sphere's centre: the potential less the kinetic energy of the flow along
/// the skin, at velocity slope / (i omega rho).
Eigen::VectorXd series_radiation(const TriangleMesh& mesh, double ka, double radius) {
  const Medium air = wave().medium();
  Eigen::VectorXd radiation(mesh.face_count());
  for (Eigen::Index f = 0; f < mesh.face_count(); ++f) {
    const SeriesPoint at = series_at(ka, radius, cosines(mesh)(f));
    const Complex velocity = at.slope / (Complex(0, 1) * wave().omega() * air.density);
    radiation(f) = std::norm(at.pressure) / (4.0 * air.density * std::pow(air.sound_speed, 2)) -
                   air.density * std::norm(velocity) / 4.0;
  }
  return radiation;
}

TEST(RadiationPressure, OfEachFaceOfASphereIsThatOfTheSeries) {
  // 6.0 edges per wavelength.
  for (const auto& [ka, subdivisions] : {std::pair{6.0, 7}, {13.0, 15}}) {
    SCOPED_TRACE(ka);
    const double radius = radius_of(ka);
    const TriangleMesh mesh = icosphere(radius, subdivisions);
    const Eigen::VectorXcd p =
        solve_sphere(Scheme::kBurtonMillerPolished, {.ka = ka, .subdivisions = subdivisions}).pressure;
    const Eigen::VectorXd found = radiation_pressure(SurfaceGradient(mesh, wave().k()), wave(), p);
    const Eigen::VectorXd exact = series_radiation(mesh, ka, radius);
    const double error = std::sqrt(mesh.areas().dot((found - exact).cwiseAbs2()) / mesh.areas().dot(exact.cwiseAbs2()));
    const double force = -mesh.areas().cwiseProduct(found).dot(mesh.normals().row(2));
    const double force_error = force / rigid_sphere_force(wave(), radius, 1.0) - 1.0;
    std::printf("ka %.0f, %.2f edges per wavelength: P %.2f %%, force %+.2f %%, least P %.2f of the largest\n", ka,
                edges_per_wavelength(mesh, wave().wavelength()), 100.0 * error, 100.0 * force_error,
                exact.minCoeff() / exact.maxCoeff());
    EXPECT_LT(error, 0.03);
    EXPECT_LT(std::abs(force_error), 0.02);
    EXPECT_LT(exact.minCoeff(), 0.0);  // there is suction, so the flow along the skin is tested
  }
}

}  // namespace touchfield::radiation_pressure_test
