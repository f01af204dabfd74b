#include <cmath>
#include <limits>
#include <string>

#include "sim/field/metrics.h"
#include "tests/support/testing.h"

namespace touchfield::exposure_limits_test {

/// "70 75 75 105", in the order of the table.
std::string levels_at(double frequency) {
  std::string text;
  for (const ExposureLimit& limit : exposure_limits(frequency)) {
    text += (text.empty() ? "" : " ") + std::to_string(std::lround(limit.level));
  }
  return text;
}

TEST(SoundLevel, IsOfTheRootMeanSquare) {
  EXPECT_NEAR(sound_level(std::sqrt(2.0)), 93.979, 1e-3);  // 1 Pa rms
  EXPECT_NEAR(sound_level(20e-6 * std::sqrt(2.0)), 0.0, 1e-12);
  EXPECT_NEAR(sound_level(2.0) - sound_level(1.0), 6.0206, 1e-4);
  EXPECT_EQ(sound_level(0.0), -std::numeric_limits<double>::infinity());
}

TEST(ExposureLimits, AreThoseOfTheThirdOctaveBand) {
  EXPECT_EQ(levels_at(20e3), "70 75 75 105");
  EXPECT_EQ(levels_at(25e3), "100 110 110 110");
  EXPECT_EQ(levels_at(40e3), "100 110 110 115");
  EXPECT_EQ(levels_at(63e3), "100 110 115");  // Health Canada ends with 50 kHz
  EXPECT_EQ(levels_at(100e3), "100 110 115");
  // Bands meet at 10^(n + 1/2)/10 Hz.
  EXPECT_EQ(levels_at(22.3e3), levels_at(20e3));
  EXPECT_EQ(levels_at(22.5e3), levels_at(25e3));
  EXPECT_EQ(levels_at(56.1e3), levels_at(50e3));
  EXPECT_EQ(levels_at(56.3e3), levels_at(63e3));
}

TEST(ExposureLimits, AreNotGivenWhereNobodyGivesThem) {
  for (const double frequency : {1e3, 17.7e3, 112.3e3, 200e3, 0.0, -1.0, std::nan("")}) {
    EXPECT_TRUE(exposure_limits(frequency).empty()) << frequency;
  }
}

}  // namespace touchfield::exposure_limits_test
