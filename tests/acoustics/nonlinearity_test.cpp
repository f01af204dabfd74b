#include <cmath>

#include <gtest/gtest.h>

#include "sim/acoustics/incident_field.h"

namespace touchfield::nonlinearity_test {

const Wave kWave(air(kRoomTemperature), 40e3);

TransducerArray omni_grid(int count) {
  return make_array(grid_layout(count, count, kAutd3Pitch), Directivity::omni(), 1.0, kAutd3SourceStrength);
}

/// beta k / (rho c^2) [1/(Pa m)]
double factor() {
  const Medium& medium = kWave.medium();
  return 1.2 * kWave.k() / (medium.density * std::pow(medium.sound_speed, 2));
}

TEST(ShockDistanceShare, OfOneTransducerGrowsWithTheLogarithmOfTheDistance) {
  const TransducerArray array = omni_grid(1);
  const Vector3 from(0, 0, 0.01);
  const Vector3 to(0, 0, 0.2);
  const double exact = factor() * 0.5 * kAutd3SourceStrength * std::log(20.0);
  const Eigen::VectorXcd half = Eigen::VectorXcd::Constant(1, Complex(0, 0.5));
  EXPECT_NEAR(shock_distance_share(array, kWave, half, from, to), exact, 1e-4 * exact);
  const double coarse = shock_distance_share(array, kWave, half, from, to, 100);
  const double fine = shock_distance_share(array, kWave, half, from, to, 200);
  EXPECT_NEAR((coarse - exact) / (fine - exact), 4.0, 0.2);  // of second order
}

TEST(ShockDistanceShare, OfAnAbsorbedPlaneWaveEnds) {
  Medium medium = air(kRoomTemperature);
  medium.absorption = 20.0;
  const double share = shock_distance_share(plane_wave(Vector3::UnitZ(), 2000.0), Wave(medium, 40e3),
                                            Eigen::VectorXcd::Ones(1), Vector3::Zero(), Vector3(0, 0, 0.2));
  EXPECT_NEAR(share, factor() * 2000.0 * (1.0 - std::exp(-20.0 * 0.2)) / 20.0, 1e-4 * share);
}

// An odd grid has a transducer in its centre, an even one has none: where counting begins neither is singular.
TEST(WaveFrontBegin, IsAWavelengthFromEveryTransducer) {
  const Vector3 to(0, 0, 0.2);
  for (const int count : {1, 2, 7, 8}) {
    const TransducerArray array = omni_grid(count);
    const Vector3 begin = wave_front_begin(array, kWave, to);
    EXPECT_NEAR((array.positions.colwise() - begin).colwise().norm().minCoeff(), kWave.wavelength(), 1e-12) << count;
    EXPECT_LT(begin.head<2>().norm(), 1e-15);
  }
  const auto sigma = [&](int count) {
    const TransducerArray array = omni_grid(count);
    return shock_distance_share(array, kWave, Eigen::VectorXcd::Ones(array.size()), wave_front_begin(array, kWave, to),
                                to);
  };
  EXPECT_NEAR(sigma(7) / (0.5 * (sigma(6) + sigma(8))), 1.0, 0.15);
}

TEST(WaveFrontBegin, IsTheEndWhereThatIsTooNear) {
  const Vector3 to(0.003, 0.002, 0.007);
  EXPECT_EQ(wave_front_begin(omni_grid(1), kWave, to), to);
  EXPECT_EQ(wave_front_begin(omni_grid(3), kWave, Vector3::Zero()), Vector3::Zero());
}

// Abramowitz and Stegun, table 9.1: J1(1) = 0.4400505857, J2(2) = 0.3528340286, J1(0.3) = 0.1483188163.
TEST(PlaneWaveHarmonic, IsFubinis) {
  EXPECT_NEAR(plane_wave_harmonic(1, 1.0), 2.0 * 0.4400505857, 1e-9);
  EXPECT_NEAR(plane_wave_harmonic(2, 1.0), 0.3528340286, 1e-9);
  EXPECT_NEAR(plane_wave_harmonic(1, 0.3), 2.0 * 0.1483188163 / 0.3, 1e-9);
  EXPECT_EQ(plane_wave_harmonic(1, 0.0), 1.0);
  EXPECT_EQ(plane_wave_harmonic(2, 0.0), 0.0);
  double energy = 0.0;  // a plane wave without losses keeps it until the shock
  for (int n = 1; n <= 200; ++n) {
    energy += std::pow(plane_wave_harmonic(n, 0.7), 2);
  }
  EXPECT_NEAR(energy, 1.0, 1e-9);
}

}  // namespace touchfield::nonlinearity_test
