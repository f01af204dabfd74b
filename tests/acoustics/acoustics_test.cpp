#include <cmath>
#include <limits>
#include <numbers>

#include "sim/acoustics/medium.h"
#include "sim/acoustics/transducer_array.h"
#include "sim/core/rigid_motion.h"
#include "sim/core/units.h"
#include "tests/support/testing.h"

namespace touchfield::acoustics_test {

constexpr double kPitch = 10.16e-3;

TEST(TransducerArray, GridOfThePaperHas1496Transducers) {
  const ArrayLayout grid = grid_layout(44, 34, kPitch);
  EXPECT_EQ(grid.positions.cols(), 1496);
  EXPECT_LT(grid.positions.rowwise().mean().norm(), 1e-15);
  // x fastest: the second transducer is one pitch along x from the first corner.
  EXPECT_LT((grid.positions.col(0) - Vector3(-21.5 * kPitch, -16.5 * kPitch, 0)).norm(), 1e-15);
  EXPECT_LT((grid.positions.col(1) - grid.positions.col(0) - Vector3(kPitch, 0, 0)).norm(), 1e-15);
  EXPECT_EQ(grid.axes.col(7), Vector3::UnitZ());
  EXPECT_EQ(grid.channel(1495), 1495);
}

TEST(TransducerArray, Autd3UnitHas249WithHolesSkipped) {
  const ArrayLayout unit = autd3_unit(kPitch);
  ASSERT_EQ(unit.positions.cols(), 249);
  EXPECT_EQ(unit.positions.col(0), Vector3::Zero());
  // Row 0 holds 18, row 1 misses x = 1, 2, 16: numbers 18, 19, 31 are x = 0, 3 and 17 of row 1 would be 32.
  EXPECT_LT((unit.positions.col(18) - kPitch * Vector3(0, 1, 0)).norm(), 1e-15);
  EXPECT_LT((unit.positions.col(19) - kPitch * Vector3(3, 1, 0)).norm(), 1e-15);
  EXPECT_LT((unit.positions.col(31) - kPitch * Vector3(15, 1, 0)).norm(), 1e-15);
  EXPECT_LT((unit.positions.col(32) - kPitch * Vector3(17, 1, 0)).norm(), 1e-15);
  EXPECT_LT((unit.positions.col(33) - kPitch * Vector3(0, 2, 0)).norm(), 1e-15);
  EXPECT_LT((unit.positions.col(248) - kPitch * Vector3(17, 13, 0)).norm(), 1e-15);
}

TEST(TransducerArray, SixAutd3UnitsTileBoardByBoard) {
  const ArrayLayout tiles = autd3_tiles(3, 2, kPitch);
  ASSERT_EQ(tiles.positions.cols(), 1494);
  EXPECT_EQ(tiles.device(0), 0);
  EXPECT_EQ(tiles.device(249), 1);
  EXPECT_EQ(tiles.device(1493), 5);
  EXPECT_EQ(tiles.channel(1493), 248);
  EXPECT_LT((tiles.positions.col(249) - tiles.positions.col(0) - Vector3(192.0e-3, 0, 0)).norm(), 1e-15);
  EXPECT_LT((tiles.positions.col(3 * 249) - tiles.positions.col(0) - Vector3(0, 151.4e-3, 0)).norm(), 1e-15);
  // Corner transducers are never holes, so the bounding box is that of the full grids.
  EXPECT_LT((tiles.positions.rowwise().minCoeff() + tiles.positions.rowwise().maxCoeff()).norm(), 1e-15);
}

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
  const double kDecibelPerNeper = 20.0 / std::numbers::ln10;
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

constexpr double kPi = std::numbers::pi;

TEST(Directivity, T4010a1PassesThroughItsTable) {
  const double table[] = {1,           1,           1,           0.891250938, 0.707945784,
                          0.501187234, 0.354813389, 0.251188643, 0.199526231, 0.177827941};
  const Directivity d = Directivity::t4010a1();
  for (int i = 0; i < 10; ++i) {
    EXPECT_NEAR(d.at(10.0 * i * kDegree).value, table[i], 1e-14) << 10 * i << " degrees";
    EXPECT_NEAR(d.at(kPi - 10.0 * i * kDegree).value, table[i], 1e-14) << "mirrored " << 10 * i << " degrees";
  }
}

TEST(Directivity, SlopesEqualCentralDifferences) {
  constexpr double kStep = 1e-6;
  for (const Directivity& d : {Directivity::omni(), Directivity::piston(732.28, 4.5e-3), Directivity::t4010a1()}) {
    for (double theta = 0.03; theta < kPi; theta += 0.1) {
      const double difference = (d.at(theta + kStep).value - d.at(theta - kStep).value) / (2 * kStep);
      EXPECT_NEAR(d.at(theta).slope, difference, 1e-8) << "theta " << theta;
    }
  }
}

TEST(Directivity, PistonHasItsFirstZeroWhereJ1Has) {
  constexpr double kFirstZero = 3.831705970207512;  // of J1
  const double k = 732.28;
  const double radius = 8e-3;
  const Directivity d = Directivity::piston(k, radius);
  EXPECT_NEAR(d.at(std::asin(kFirstZero / (k * radius))).value, 0.0, 1e-12);
  EXPECT_DOUBLE_EQ(d.value(1.0), 1.0);
  // Series and Bessel function meet: 1 - x^2/8 + x^4/192.
  const double x = 1e-3;
  EXPECT_NEAR(Directivity::piston(1.0, 1.0).at(std::asin(x)).value, 1 - x * x / 8, x * x * x * x);
  EXPECT_THROW(Directivity::piston(732.0, 0.0), InputError);
}

}  // namespace touchfield::acoustics_test
