#include <numbers>

#include <gtest/gtest.h>

#include "sim/motion/pattern.h"

namespace touchfield {
namespace {

/// sin(pi x) / (pi x)
double sinc(double x) { return std::sin(std::numbers::pi * x) / (std::numbers::pi * x); }

// |p|^2 of p = 1 - d (1 - cos)/2 has lines at hz and 2 hz alone: with s = 1 - d/2 and e = d/2,
// (s + e cos)^2 = s^2 + e^2/2 + 2 s e cos + e^2/2 cos 2.
TEST(HeldSignal, AmplitudeModulationHasItsLineAndTheNext) {
  constexpr int kFrames = 100;
  constexpr double kRate = 5000;  // 50 Hz, a turn in 100 frames
  constexpr double kDepth = 0.8;
  Eigen::VectorXd square(kFrames);
  for (int k = 0; k < kFrames; ++k) {
    const double p = 1.0 - 0.5 * kDepth * (1.0 - std::cos(2.0 * std::numbers::pi * k / kFrames));
    square(k) = p * p;
  }
  const std::vector<SpectralLine> lines = lines_of_held(square, kRate, 500);
  ASSERT_EQ(lines.size(), 10U);
  const double s = 1.0 - 0.5 * kDepth;
  const double e = 0.5 * kDepth;
  EXPECT_DOUBLE_EQ(lines[0].hz, 50);
  EXPECT_NEAR(lines[0].mean_square, 2.0 * std::pow(s * e * sinc(0.01), 2), 1e-12);
  EXPECT_NEAR(lines[1].mean_square, 0.5 * std::pow(0.5 * e * e * sinc(0.02), 2), 1e-12);
  for (std::size_t m = 2; m < lines.size(); ++m) EXPECT_LT(lines[m].mean_square, 1e-20) << lines[m].hz;
}

// A spot that passes a point once in a period, for a share s of it: a rectangle, whose lines are 2 (s sinc(m s))^2.
TEST(HeldSignal, APointPassedOncePerPeriodHasTheLinesOfARectangle) {
  constexpr int kFrames = 40;
  constexpr int kHeld = 6;
  Eigen::VectorXd pressure = Eigen::VectorXd::Zero(kFrames);
  pressure.segment(9, kHeld).setConstant(3.0);
  const std::vector<SpectralLine> lines = lines_of_held(pressure, 1000, 1e5);
  constexpr double kShare = static_cast<double>(kHeld) / kFrames;
  double sum = 0.0;
  for (std::size_t m = 1; m <= lines.size(); ++m) {
    EXPECT_NEAR(lines[m - 1].mean_square, 2.0 * std::pow(3.0 * kShare * sinc(static_cast<double>(m) * kShare), 2),
                1e-12);
    sum += lines[m - 1].mean_square;
  }
  EXPECT_NEAR(sum, 9.0 * kShare * (1.0 - kShare), 1e-3);  // the variance, as all lines together have it
}

// Lines every 0.05 Hz: their series would fill files. Bins of 0.1 Hz have the same sums.
TEST(HeldSignal, NarrowLinesAreAddedUpInBins) {
  constexpr int kFrames = 40;
  constexpr int kHeld = 6;
  Eigen::VectorXd pressure = Eigen::VectorXd::Zero(kFrames);
  pressure.head(kHeld).setConstant(3.0);
  const std::vector<SpectralLine> bins = lines_of_held(pressure, 2, 500);
  ASSERT_EQ(bins.size(), 5001U);  // the last line begins a bin
  constexpr double kShare = static_cast<double>(kHeld) / kFrames;
  const auto line = [&](double m) { return 2.0 * std::pow(3.0 * kShare * sinc(m * kShare), 2); };
  EXPECT_EQ(bins[0].hz, 0.0);
  EXPECT_NEAR(bins[0].mean_square, line(1), 1e-12);
  for (std::size_t i = 1; i < 100; ++i) {
    const auto m = 2.0 * static_cast<double>(i);
    EXPECT_EQ(bins[i].hz, static_cast<double>(i) / 10.0);
    EXPECT_EQ(bins[i].width, 0.1);
    EXPECT_NEAR(bins[i].mean_square, line(m) + line(m + 1.0), 1e-12) << i;
  }
}

TEST(HeldSignal, BandsDoNotOverlap) {
  const std::vector<SpectralLine> lines = {{5, 1}, {15, 2}, {60, 4}, {200, 8}, {500, 16}};
  double sum = 0.0;
  for (const FrequencyBand& band : kTouchBands) sum += mean_square_in(lines, band);
  EXPECT_EQ(sum, 15);
  EXPECT_EQ(mean_square_in(lines, {15, 60}), 2);
}

}  // namespace
}  // namespace touchfield
