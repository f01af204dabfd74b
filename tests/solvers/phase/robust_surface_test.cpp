#include <random>

#include <gtest/gtest.h>

#include "solvers/phase/phase_methods.h"
#include "solvers/phase/skin_problem.h"
#include "solvers/phase/surface.h"
#include "tests/support/skin_support.h"

namespace touchfield {
namespace {

constexpr ChannelTolerances kUsual = {.phase = 0.35, .gain = 0.1, .dead = 0.02};

/// Mean of the cost over draws of channels, and what it is uncertain by.
std::pair<double, double> mean_cost(const SkinProblem& problem, const Eigen::VectorXcd& q,
                                    const ChannelTolerances& tolerances, int draws) {
  std::mt19937_64 generator(11);
  std::normal_distribution<double> normal;
  std::bernoulli_distribution dead(tolerances.dead);
  Eigen::VectorXd costs(draws);
  for (double& cost : costs) {
    Eigen::VectorXcd real = q;
    for (std::complex<double>& drive : real) {
      const double gain = dead(generator) ? 0.0 : 1.0 + tolerances.gain * normal(generator);
      drive *= gain * std::polar(1.0, tolerances.phase * normal(generator));
    }
    cost = skin_cost(problem, real);
  }
  return {costs.mean(), std::sqrt((costs.array() - costs.mean()).square().mean() / draws)};
}

TEST(RobustSurface, MomentsAreThoseOfDraws) {
  std::mt19937_64 generator(3);
  std::normal_distribution<double> normal;
  std::bernoulli_distribution dead(kUsual.dead);
  std::complex<double> mean = 0.0;
  double square = 0.0;
  constexpr int kDraws = 400'000;
  for (int i = 0; i < kDraws; ++i) {
    const double gain = dead(generator) ? 0.0 : 1.0 + kUsual.gain * normal(generator);
    mean += gain * std::polar(1.0 / kDraws, kUsual.phase * normal(generator));
    square += gain * gain / kDraws;
  }
  const ChannelMoments moments = channel_moments(kUsual);
  EXPECT_NEAR(moments.mean, std::abs(mean), 2e-3);  // four deviations of the mean of the draws
  EXPECT_NEAR(moments.variance, square - std::norm(mean), 3e-3);
  const ChannelMoments exact = channel_moments({});
  EXPECT_EQ(exact.mean, 1.0);
  EXPECT_EQ(exact.variance, 0.0);
}

TEST(RobustSurface, TheExpectedCostBoundsTheMeanOfDrawsClosely) {
  const SkinProblem problem = random_problem(6, 10, 200, 0.3, 1);
  const Eigen::VectorXcd q = random_drives(200, 2);
  const double bound = expected_cost(problem, q, kUsual);
  const auto [mean, uncertainty] = mean_cost(problem, q, kUsual, 4000);
  EXPECT_GT(bound, mean - 4.0 * uncertainty);
  EXPECT_LT(bound, 1.05 * mean);
  EXPECT_NEAR(expected_cost(problem, q, {}), skin_cost(problem, q), 1e-12 * skin_cost(problem, q));
}

TEST(RobustSurface, LowersTheMeanCostOfDrawsThatItHasNotSeen) {
  // Little is wanted of many channels: at full drive most of their sound is to cancel.
  const SkinProblem problem = random_problem(5, 30, 60, 0.05, 4);
  const Eigen::MatrixXcd start = Eigen::VectorXcd::Ones(60);
  const PhaseMethod& surface = phase_method("surface");
  const PhaseSolution plain = surface.solve(problem, start, {.iterations = 60}, {});
  const PhaseSolution robust = surface.solve(problem, start, {.iterations = 60, .tolerances = kUsual}, {});
  EXPECT_LE(robust.amplitudes.maxCoeff(), 1.0);
  EXPECT_EQ(robust.amplitudes.minCoeff(), robust.amplitudes.maxCoeff());
  EXPECT_LT(expected_cost(problem, drive(robust), kUsual), expected_cost(problem, drive(plain), kUsual));
  const auto [plain_mean, plain_deviation] = mean_cost(problem, drive(plain), kUsual, 500);
  const auto [robust_mean, robust_deviation] = mean_cost(problem, drive(robust), kUsual, 500);
  EXPECT_LT(robust_mean, plain_mean - 3.0 * (plain_deviation + robust_deviation));
  // What it says of itself is the expected cost of what it returns, which never rose.
  EXPECT_NEAR(robust.cost_history.back(), expected_cost(problem, drive(robust), kUsual),
              1e-9 * robust.cost_history.back());
  EXPECT_TRUE(std::ranges::is_sorted(robust.cost_history, std::greater<>()));
}

TEST(RobustSurface, ASmallTurnOfAnyChannelOrOfTheLevelGainsNothing) {
  const SkinProblem problem = random_problem(5, 20, 40, 0.1, 7);
  const PhaseSolution found =
      phase_method("surface").solve(problem, Eigen::VectorXcd::Ones(40), {.iterations = 300, .tolerances = kUsual}, {});
  EXPECT_EQ(found.status, PhaseStatus::kConverged);
  const double least = expected_cost(problem, drive(found), kUsual);
  for (Eigen::Index n = 0; n < 40; ++n) {
    for (const double turn : {-0.02, 0.02}) {
      Eigen::VectorXcd q = drive(found);
      q(n) *= std::polar(1.0, turn);
      EXPECT_GT(expected_cost(problem, q, kUsual), least * (1.0 - 1e-4)) << n;  // the share at which it settles
    }
  }
  for (const double factor : {0.95, 1.05}) {
    EXPECT_GT(expected_cost(problem, factor * drive(found), kUsual), least * (1.0 - 1e-4));
  }
}

}  // namespace
}  // namespace touchfield
