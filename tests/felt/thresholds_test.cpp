#include "sim/felt/thresholds.h"

#include <gtest/gtest.h>

#include "sim/core/errors.h"

namespace touchfield::thresholds_test {

double octave_above(TouchChannel channel, double hz) {
  return relative_threshold(channel, 2.0 * hz).value() - relative_threshold(channel, hz).value();
}

TEST(RelativeThreshold, HasThePublishedSlopesAndBest) {
  EXPECT_NEAR(octave_above(TouchChannel::kPacinian, 40.0), -12.0, 1e-9);
  EXPECT_NEAR(octave_above(TouchChannel::kPacinian, 125.0), -12.0, 1e-9);
  EXPECT_NEAR(octave_above(TouchChannel::kPacinian, 250.0), 9.0, 1e-9);
  EXPECT_NEAR(octave_above(TouchChannel::kRapidlyAdapting, 20.0), 0.0, 1e-9);
  EXPECT_EQ(relative_threshold(TouchChannel::kPacinian, 250.0), 0.0);
}

TEST(RelativeThreshold, IsNotExtrapolated) {
  for (const double hz : {1.0, 9.9, 40.1, 250.0}) {
    EXPECT_FALSE(relative_threshold(TouchChannel::kRapidlyAdapting, hz)) << hz;
  }
  for (const double hz : {10.0, 39.9, 500.1}) {
    EXPECT_FALSE(relative_threshold(TouchChannel::kPacinian, hz)) << hz;
  }
  EXPECT_THROW(relative_threshold(TouchChannel::kPacinian, 0.0), InputError);
}

}  // namespace touchfield::thresholds_test
