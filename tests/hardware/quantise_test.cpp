#include <numbers>

#include "hardware/drive_frame.h"
#include "tests/support/testing.h"

namespace touchfield::quantise_test {

constexpr double kPi = std::numbers::pi;

Eigen::VectorXd ones(Eigen::Index n) { return Eigen::VectorXd::Ones(n); }

class Levels : public testing::TestWithParam<int> {};

// The nearest of L steps round the circle, for any phase, from both sides of 0.
TEST_P(Levels, TakeTheNearestStep) {
  const DriveSteps steps{GetParam(), 256};
  const Eigen::VectorXd phases = Eigen::VectorXd::LinSpaced(4001, -3 * kPi, 5 * kPi);
  const QuantisedDrive q = quantise(phases, ones(phases.size()), 1, steps, "device");
  const Eigen::VectorXd back = phases_of(q.frame, steps);
  double worst = 0;
  double squares = 0;
  for (Eigen::Index n = 0; n < phases.size(); ++n) {
    ASSERT_LT(q.frame.phase[static_cast<std::size_t>(n)], GetParam());
    const double error = std::remainder(back(n) - phases(n), 2 * kPi);
    worst = std::max(worst, std::abs(error));
    squares += error * error;
  }
  EXPECT_LE(worst, kPi / GetParam() * (1 + 1e-12));
  EXPECT_NEAR(q.report.worst_phase_error, worst, 1e-12);
  EXPECT_NEAR(q.report.rms_phase_error, std::sqrt(squares / static_cast<double>(phases.size())), 1e-12);
}

// Evenly spread phases: the error is even over a step, so rms = step / sqrt(12), and what is left of the drives is the
// mean of exp(i error), sin(x)/x of half a step.
TEST_P(Levels, ErrorOfEvenlySpreadPhases) {
  const double levels = GetParam();
  constexpr Eigen::Index kCount = 1 << 16;
  const Eigen::VectorXd phases = Eigen::VectorXd::NullaryExpr(
      kCount, [&](Eigen::Index n) { return 2 * kPi * (static_cast<double>(n) + 0.5) / kCount; });
  const QuantisationReport report = quantise(phases, ones(kCount), 1, {GetParam(), 256}, "device").report;
  const double half = kPi / levels;
  const double loss = 1 - std::pow(std::sin(half) / half, 2);
  // With n phases a step the sums miss the integrals by 1 / n^2.
  EXPECT_NEAR(report.rms_phase_error, 2 * half / std::sqrt(12), half * std::pow(levels / kCount, 2));
  EXPECT_NEAR(report.worst_drive_loss, loss, loss * std::pow(levels / kCount, 2));
}

INSTANTIATE_TEST_SUITE_P(Devices, Levels, testing::Values(256, 32, 16, 2));

// The last half step before a whole period is 0: one step more would be `off` on a device that has 32 steps and off.
TEST(Quantise, WrapsToZero) {
  const Eigen::Vector3d phases(2 * kPi * (1 - 0.499 / 32), 2 * kPi * (1 - 0.501 / 32), -1e-300);
  EXPECT_THAT(quantise(phases, ones(3), 1, {32, 2}, "device").frame.phase, ElementsAre(0, 31, 0));
}

// An amplitude is never louder than asked for, and full is full.
TEST(Quantise, IntensityIsRoundedDown) {
  const Eigen::Vector4d amplitudes(1, 0.999, 0.5, 0);
  const Eigen::VectorXd phases = Eigen::VectorXd::Zero(4);
  EXPECT_THAT(quantise(phases, amplitudes, 1, {256, 256}, "device").frame.intensity, ElementsAre(255, 254, 127, 0));
  EXPECT_THAT(quantise(phases, amplitudes, 0.5, {256, 256}, "device").frame.intensity, ElementsAre(127, 127, 63, 0));
  // 0.1 * 10 is not exactly 1; the step must be all the same.
  EXPECT_THAT(quantise(phases, ones(4), 0.1, {256, 11}, "device").frame.intensity, ElementsAre(1, 1, 1, 1));
  EXPECT_LE(level_of(quantise(phases, amplitudes, 0.37, {256, 256}, "device").frame, {256, 256}), 0.37);
}

TEST(Quantise, LossIsThatOfTheShapeAlone) {
  // Half of the transducers are lost: |sum w* q|^2 / (sum |w|^2 sum |q|^2) = 1 / 2.
  Eigen::VectorXd amplitudes = ones(8);
  amplitudes.tail(4).setConstant(0.4);
  const Eigen::VectorXd phases = Eigen::VectorXd::Zero(8);
  EXPECT_NEAR(quantise(phases, ones(8), 0.1, {256, 11}, "device").report.worst_drive_loss, 0, 1e-15);
  // Steps of 0 and 1 only: 0.4 becomes 0. w = (1, 0.4), q = (1, 0): 1 - 16 / ((4 + 0.64) 4).
  EXPECT_NEAR(quantise(phases, amplitudes, 1, {256, 3}, "device").report.worst_drive_loss, 1 - 16 / (4.64 * 4), 1e-12);
  EXPECT_EQ(quantise(phases, Eigen::VectorXd::Zero(8), 1, {256, 3}, "device").report.worst_drive_loss, 0);
  EXPECT_EQ(quantise(phases, ones(8), 0.3, {256, 3}, "device").report.worst_drive_loss, 1);
}

TEST(Quantise, ADeviceOfOnAndOffRefusesTheRest) {
  const Eigen::VectorXd phases = Eigen::VectorXd::Zero(2);
  EXPECT_THAT(quantise(phases, Eigen::Vector2d(1, 0), 1, {32, 2}, "board").frame.intensity, ElementsAre(1, 0));
  EXPECT_THAT(
      [&] {
        quantise(phases, Eigen::Vector2d(1, 0.5), 1, {32, 2}, "board");
      },
      ThrowsMessage<InputError>(HasSubstr("board: it drives a transducer fully or not at all")));
  EXPECT_THROW(quantise(phases, ones(2), 0.5, {32, 2}, "board"), InputError);
}

TEST(Quantise, RefusesWhatIsNoDrive) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  const DriveSteps steps;
  const Eigen::Vector2d phases(0, 1);
  EXPECT_THROW(quantise(phases, ones(3), 1, steps, "device"), InputError);
  EXPECT_THROW(quantise(Eigen::Vector2d(0, kNan), ones(2), 1, steps, "device"), InputError);
  EXPECT_THROW(quantise(Eigen::Vector2d(0, 1 / 0.0), ones(2), 1, steps, "device"), InputError);
  EXPECT_THROW(quantise(phases, Eigen::Vector2d(0, 1.001), 1, steps, "device"), InputError);
  EXPECT_THROW(quantise(phases, Eigen::Vector2d(0, -0.1), 1, steps, "device"), InputError);
  EXPECT_THROW(quantise(phases, Eigen::Vector2d(0, kNan), 1, steps, "device"), InputError);
  EXPECT_THROW(quantise(phases, ones(2), 1.1, steps, "device"), InputError);
  EXPECT_THROW(quantise(phases, ones(2), kNan, steps, "device"), InputError);
}

// From 1e17 rad a double does not even tell one turn from the next.
TEST(Quantise, RefusesPhasesThatKnowNoTurn) {
  EXPECT_NO_THROW(quantise(Eigen::Vector2d(-kMostPhase, kMostPhase), ones(2), 1, {}, "device"));
  for (const double phase : {1e17, -1e17, 1.001e6}) {
    EXPECT_THAT([&] { quantise(Eigen::Vector2d(0, phase), ones(2), 1, {}, "device"); },
                ThrowsMessage<InputError>(HasSubstr("device: the phase of transducer 1 is ")));
  }
}

}  // namespace touchfield::quantise_test
