#include "sim/bem/rigid_sphere.h"

#include <cmath>
#include <numbers>

#include "tests/support/testing.h"

namespace touchfield::rigid_sphere_test {

Wave wave(double frequency = 40e3) { return {air(293.15), frequency}; }

const Eigen::Vector3d kAxis(1.0, 0.0, -1.0);  // cos theta at 0, 90, 180 degrees

// Eight decimals are printed in the reference table.
constexpr double kTable = 1e-8;

TEST(RigidSphere, PlaneWaveAgainstTheTable) {
  const struct {
    double ka;
    double abs_p[3];
  } rows[] = {{1, {1.06812040, 0.97329998, 1.41839564}},
              {5, {1.14519967, 1.24799882, 1.87407653}},
              {10, {1.04528420, 1.32325673, 1.95705403}},
              {20, {0.83779661, 1.34920494, 1.98717963}}};
  for (const auto& row : rows) {
    const Eigen::VectorXcd p = rigid_sphere_plane_wave(wave(), row.ka / wave().k(), kAxis);
    for (int i = 0; i < 3; ++i) {
      EXPECT_NEAR(std::abs(p(i)), row.abs_p[i], kTable) << "ka " << row.ka;
    }
  }
}

TEST(RigidSphere, EightMillimetresAt40Kilohertz) {
  const Eigen::VectorXcd p = rigid_sphere_plane_wave(wave(), 8e-3, kAxis);
  const Complex expected[] = {{-1.129850, -0.076383}, {1.290302, -0.138109}, {1.819106, 0.530108}};
  for (int i = 0; i < 3; ++i) {
    EXPECT_LT(std::abs(p(i) - expected[i]), 1e-6);  // six decimals
  }
}

TEST(RigidSphere, PointSourceAt200Millimetres) {
  const Eigen::VectorXcd p = rigid_sphere_point_source(wave(), 8e-3, 0.2, kAxis);
  const Complex expected[] = {{-0.4793002, 0.6217205}, {-0.1965248, 0.4628361}, {0.2300146, -0.3534434}};
  for (int i = 0; i < 3; ++i) {
    EXPECT_LT(std::abs(p(i) - expected[i]), 1e-7);
  }
}

TEST(RigidSphere, ForceIsTheIntegralOfItsOwnPressure) {
  // 2,000 rings of |p|^2 / (4 rho c^2) - |grad p|^2 / (4 rho omega^2), by the midpoint rule and central differences.
  const Wave w = wave();
  const Eigen::VectorXd angle = (Eigen::VectorXd::LinSpaced(2000, 0.5, 1999.5) * std::numbers::pi / 2000.0).eval();
  for (const double ka : {0.3, 1.0, 5.0, 13.0}) {
    const double radius = ka / w.k();
    const auto at = [&](double turn) {
      return rigid_sphere_plane_wave(w, radius, (angle.array() + turn).cos().matrix());
    };
    const Eigen::ArrayXd slope = ((at(1e-5) - at(-1e-5)) / (2e-5 * ka)).cwiseAbs2().array();
    const Eigen::ArrayXd push = at(0.0).cwiseAbs2().array() - slope;
    const double sum = -(push * angle.array().cos() * angle.array().sin()).sum() * std::numbers::pi / 2000.0;
    const Medium air = w.medium();
    const double expected =
        9.0 * 2.0 * std::numbers::pi * radius * radius * sum / (4.0 * air.density * air.sound_speed * air.sound_speed);
    EXPECT_NEAR(rigid_sphere_force(w, radius, 3.0) / expected, 1.0, 1e-5) << "ka " << ka;
  }
}

TEST(RigidSphere, ForceOfALongWaveIsKings) {
  // A sphere held still: Y = (11/9) (ka)^4 (1 + O((ka)^2)) as its density goes to infinity.
  const Wave w = wave();
  const double ka = 0.1;
  const double radius = ka / w.k();
  const Medium air = w.medium();
  const double energy_density = 0.5 / (air.density * air.sound_speed * air.sound_speed);
  EXPECT_NEAR(rigid_sphere_force(w, radius, 1.0) / (std::numbers::pi * radius * radius * energy_density),
              11.0 / 9.0 * std::pow(ka, 4), 0.02 * std::pow(ka, 4));
}

TEST(RigidSphere, StaysFiniteWhereHankelFunctionsOverflow) {
  EXPECT_TRUE(rigid_sphere_plane_wave(wave(), 100.0 / wave().k(), kAxis).allFinite());
  EXPECT_TRUE(rigid_sphere_plane_wave(wave(), 0.1 / wave().k(), kAxis).allFinite());
  EXPECT_TRUE(rigid_sphere_point_source(wave(), 0.01 / wave().k(), 1.0, kAxis).allFinite());
}

}  // namespace touchfield::rigid_sphere_test
