#include <numbers>
#include <random>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "sim/motion/motion_prediction.h"

namespace touchfield::kalman_bank_test {

constexpr double kBetweenSamples = 1 / 30.0;
constexpr double kCameraNoise = 0.07e-3;  // of what three D415 see of a fingertip [m]

Eigen::VectorXd gaussian(Eigen::Index count, double rms, std::mt19937_64& random) {
  std::normal_distribution<double> normal(0, rms);
  return Eigen::VectorXd::NullaryExpr(count, [&] { return normal(random); });
}

/// After so many samples of zero, a time 1 apart.
KalmanFilter settled(int order, double noise, int samples, double d = 1) {
  KalmanFilter filter(order, noise);
  const Eigen::VectorXd zero = Eigen::VectorXd::Zero(1);
  Eigen::VectorXd innovation;
  filter.begin(zero);
  for (int k = 1; k < samples; ++k) filter.see(d, zero, innovation);
  return filter;
}

TEST(KalmanFilter, SteadyGainsAreThoseOfBenedictAndBordner) {
  for (const double noise : {1e-4, 0.02, 1.0, 100.0}) {
    const KalmanFilter filter = settled(2, noise, 2000);
    const double a = filter.gains()(0);
    const double b = filter.gains()(1);
    EXPECT_NEAR(b, a * a / (2 - a), 1e-12) << noise;
    EXPECT_NEAR(b * b / (1 - a), noise, 1e-9 * noise);
  }
}

// A time twice as long is eight times the noise, and a velocity of twice as much in that time.
TEST(KalmanFilter, TimeHasNoUnit) {
  const KalmanFilter one = settled(2, 0.8, 500);
  const KalmanFilter two = settled(2, 0.1, 500, 2);
  EXPECT_NEAR(two.gains()(0), one.gains()(0), 1e-12);
  EXPECT_NEAR(2 * two.gains()(1), one.gains()(1), 1e-12);
}

TEST(KalmanFilter, IsAMeanWithoutNoiseAndALineWithMuch) {
  std::mt19937_64 random(1);
  KalmanFilter still(2, 0);
  KalmanFilter quick(2, 1e12);
  const Eigen::VectorXd values = gaussian(6, 1, random);
  Eigen::VectorXd innovation;
  for (KalmanFilter* filter : {&still, &quick}) {
    filter->begin(values.head(1));
    for (int k = 1; k < 6; ++k) filter->see(1, values.segment(k, 1), innovation);
  }
  const auto expected = [](const KalmanFilter& filter, double d) {
    Eigen::VectorXd sum = Eigen::VectorXd::Zero(1);
    filter.add(d, 1, sum);
    return sum(0);
  };
  EXPECT_NEAR(expected(still, 3), values.mean(), 1e-12);
  EXPECT_NEAR(expected(quick, 3), values(5) + 3 * (values(5) - values(4)), 1e-9);
}

TEST(KalmanFilter, OfOrderThreeFollowsAParabola) {
  KalmanFilter filter(3, 1);
  const auto parabola = [](double t) { return Eigen::VectorXd::Constant(1, 2 - 3 * t + 0.5 * t * t).eval(); };
  Eigen::VectorXd innovation;
  filter.begin(parabola(0));
  for (int k = 1; k <= 100; ++k) filter.see(1, parabola(k), innovation);
  Eigen::VectorXd expected = Eigen::VectorXd::Zero(1);
  filter.add(4, 1, expected);
  EXPECT_NEAR(expected(0), parabola(104)(0), 1e-8);
}

/// Rms error 0.1 s ahead of samples of a motion that four points make, noise added: that of the bank as a share of
/// that of a straight line through the last two samples.
double share_of_a_line(const std::function<double(double)>& motion, double interval = kBetweenSamples) {
  constexpr double kBegin = 0.7;  // [s]
  constexpr double kAhead = 0.1;
  double by_bank = 0;
  double by_line = 0;
  for (unsigned seed = 0; seed < 40; ++seed) {
    std::mt19937_64 random(seed);
    KalmanBank bank(interval);
    Eigen::VectorXd before = Eigen::VectorXd::Zero(12);
    for (int k = 0; k * interval < 2; ++k) {
      const double now = k * interval;
      const Eigen::VectorXd seen = Eigen::VectorXd::Constant(12, motion(now)) + gaussian(12, kCameraNoise, random);
      bank.see(now, seen, 12);
      if (now > kBegin) {
        const double truth = motion(now + kAhead);
        by_bank += (bank.at(now + kAhead).array() - truth).square().mean();
        by_line += ((seen + kAhead / interval * (seen - before)).array() - truth).square().mean();
      }
      before = seen;
    }
  }
  return std::sqrt(by_bank / by_line);
}

// At rest it averages. A filter at constant velocity would be as good as the line at best where the motion turns.
TEST(KalmanBank, IsBetterThanALine) {
  constexpr double kTurn = 2 * std::numbers::pi;
  for (const double interval : {1 / 100.0, 1 / 30.0, 1 / 10.0}) {
    EXPECT_LT(share_of_a_line([](double) { return 0.1; }, interval), 0.25) << interval;
  }
  for (const auto& [speed, share] : {std::pair(0.01, 0.45), std::pair(0.05, 0.7), std::pair(0.2, 0.95)}) {
    EXPECT_LT(share_of_a_line([speed](double t) { return speed * t; }), share) << speed;
  }
  for (const double speed : {0.05, 0.1, 0.2}) {
    EXPECT_LT(share_of_a_line([speed](double t) { return speed / kTurn * std::sin(kTurn * t); }), 0.85) << speed;
  }
}

TEST(KalmanBank, WithoutNoiseASteadyMotionIsExactAtAnyTimes) {
  KalmanBank bank(kBetweenSamples);
  const Eigen::Vector3d begin(0.1, -0.2, 0.3);
  const Eigen::Vector3d velocity(0.05, 0.02, -0.01);
  double now = 1;
  for (int k = 0; k < 40; ++k) {
    now += k % 3 == 0 ? 0.08 : 0.02;
    bank.see(now, begin + now * velocity, 3);
  }
  EXPECT_LT((bank.at(now + 0.1) - begin - (now + 0.1) * velocity).norm(), 1e-7);
}

// Values that are not evaluated by follow with the weights of those that are.
TEST(KalmanBank, CommutesWithWhatIsLinear) {
  std::mt19937_64 random(7);
  const Eigen::MatrixXd map = Eigen::MatrixXd::Random(5, 6);
  KalmanBank bank(kBetweenSamples);
  for (int k = 0; k < 30; ++k) {
    Eigen::VectorXd seen(11);
    seen.head(6) = gaussian(6, 1, random);
    seen.tail(5) = map * seen.head(6);
    bank.see(k * kBetweenSamples, seen, 6);
    const Eigen::VectorXd expected = bank.at(k * kBetweenSamples + 0.1);
    EXPECT_LT((expected.tail(5) - map * expected.head(6)).norm(), 1e-11);
  }
}

}  // namespace touchfield::kalman_bank_test
