#include "sim/acoustics/medium.h"

#include <limits>

#include "sim/core/units.h"
#include "tests/support/testing.h"

namespace touchfield::medium_test {

TEST(Medium, AirAtTwentyDegrees) {
  const Medium medium = air(293.15);
  EXPECT_DOUBLE_EQ(medium.sound_speed, 343.21);
  EXPECT_DOUBLE_EQ(medium.density, 1.2041);
  EXPECT_EQ(medium.absorption, 0.0);
}

TEST(Medium, AcousticImpedanceOfAnIdealGasFallsWithTheRootOfTemperature) {
  const Medium warm = air(303.15);
  const Medium cold = air(283.15);
  EXPECT_NEAR(warm.density * warm.sound_speed / (cold.density * cold.sound_speed), std::sqrt(283.15 / 303.15), 1e-12);
  EXPECT_THROW(air(0.0), InputError);
  EXPECT_THROW(air(std::numeric_limits<double>::quiet_NaN()), InputError);
}

TEST(Medium, AbsorptionOfIso9613) {
  // 1.318 dB/m at 40 kHz, 20 C, 50 %.
  EXPECT_NEAR(air_absorption(293.15, 0.5, 40e3) * kDecibelPerNeper, 1.318, 5e-4);
  // ISO 9613-1 table 1: 4.66e-3 dB/m at 1 kHz, 20 C, 50 %; the table gives three digits at the exact midband frequency.
  EXPECT_NEAR(air_absorption(293.15, 0.5, 1000.0) * kDecibelPerNeper, 4.66e-3, 0.02e-3);
}

TEST(Medium, WaveFollowsFromMediumAndFrequency) {
  const Wave wave(air(293.15), 40e3);
  EXPECT_NEAR(wave.k(), 732.28, 0.01);
  EXPECT_NEAR(wave.wavelength(), 8.580e-3, 1e-6);
  EXPECT_EQ(wave.wavenumber().imag(), 0.0);
  EXPECT_THROW(Wave(air(293.15), 0.0), InputError);
  EXPECT_THROW(Wave({343.0, -1.0, 0.0}, 40e3), InputError);
  EXPECT_THROW(Wave({343.0, 1.2, -0.1}, 40e3), InputError);
}

}  // namespace touchfield::medium_test
