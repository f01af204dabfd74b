#include "solvers/phase/skin_problem.h"

#include <limits>
#include <stdexcept>

#include <gtest/gtest.h>

#include "tests/support/skin_support.h"

namespace touchfield::skin_problem_test {

constexpr double kRounding = 1e-13;  // sums of some tens of terms of one sign

TEST(SkinProblem, CostIsTheSumOverItsRows) {
  const SkinProblem problem = random_problem(5, 3, 7, 0.5, 1);
  const Eigen::VectorXcd q = random_drives(7, 2);
  double expected = 0.0;
  for (Eigen::Index j = 0; j < 5; ++j) {
    std::complex<double> u = 0.0;
    for (Eigen::Index n = 0; n < 7; ++n) u += problem.target(j, n) * q(n);
    expected += problem.weights(j) * std::pow(std::abs(u) - problem.amplitudes(j), 2);
  }
  for (Eigen::Index i = 0; i < 3; ++i) {
    std::complex<double> t = 0.0;
    for (Eigen::Index n = 0; n < 7; ++n) t += problem.outside(i, n) * q(n);
    expected += std::norm(t);
  }
  EXPECT_NEAR(skin_cost(problem, q), expected, kRounding * expected);
}

TEST(SkinProblem, GradientEqualsCentralDifferences) {
  for (unsigned seed = 10; seed < 15; ++seed) {
    const SkinProblem problem = random_problem(6, 4, 9, 0.4, seed);
    const Eigen::VectorXcd q = random_drives(9, seed + 100);
    const Eigen::VectorXd gradient = 2.0 * skin_half_gradient(problem, q);
    constexpr double kStep = 1e-5;  // truncation 1e-10 and rounding eps / 1e-5 are both far below the tolerance
    for (Eigen::Index n = 0; n < 9; ++n) {
      Eigen::VectorXcd up = q;
      Eigen::VectorXcd down = q;
      up(n) *= std::polar(1.0, kStep);
      down(n) *= std::polar(1.0, -kStep);
      const double difference = (skin_cost(problem, up) - skin_cost(problem, down)) / (2.0 * kStep);
      EXPECT_NEAR(gradient(n), difference, 1e-6 * gradient.norm()) << "seed " << seed << " channel " << n;
    }
  }
}

TEST(SkinProblem, ASilentFaceHasASubgradientThatLeadsOutOfSilence) {
  SkinProblem problem;
  problem.target.resize(1, 2);
  problem.target << 1.0, -1.0;
  problem.amplitudes = Eigen::VectorXd::Constant(1, 0.5);
  problem.weights = Eigen::VectorXd::Ones(1);
  problem.outside.resize(0, 2);
  const Eigen::VectorXcd q = Eigen::VectorXcd::Ones(2);
  const Eigen::VectorXd slope = skin_half_gradient(problem, q);
  // |u| grows by |t_1 - t_2| for turns t: both subgradients of that kind have entries of +-p' and opposite signs.
  EXPECT_NEAR(std::abs(slope(0)), 0.5, kRounding);
  EXPECT_NEAR(slope(0) + slope(1), 0.0, kRounding);
  const Eigen::Vector2d phases = -0.1 * slope;
  const Eigen::Vector2cd moved(std::polar(1.0, phases(0)), std::polar(1.0, phases(1)));
  EXPECT_LT(skin_cost(problem, moved), skin_cost(problem, q));

  problem.amplitudes.setZero();  // silence is what is wanted
  EXPECT_EQ(skin_half_gradient(problem, q).norm(), 0.0);
  problem.target.setZero();  // and what a face in a perfect shadow gets
  problem.amplitudes.setOnes();
  EXPECT_EQ(skin_half_gradient(problem, q).norm(), 0.0);
}

TEST(SkinProblem, BestLevelIsTheBestOfAScan) {
  int at_the_limit = 0;
  int inside = 0;
  for (unsigned seed = 20; seed < 40; ++seed) {
    const SkinProblem problem = random_problem(5, seed % 3, 8, seed % 2 == 0 ? 0.05 : 0.8, seed);
    const Eigen::VectorXcd q = random_drives(8, seed + 100);
    const double limit = 1.0 / q.cwiseAbs().maxCoeff();
    const double level = best_level(problem, q);
    ASSERT_GE(level, 0.0);
    ASSERT_LE(level, limit);
    (level == limit ? at_the_limit : inside) += 1;
    const double reached = skin_cost(problem, level * q);
    double best = std::numeric_limits<double>::infinity();
    for (int i = 0; i <= 1000; ++i) best = std::min(best, skin_cost(problem, limit * i / 1000.0 * q));
    EXPECT_LE(reached, best * (1.0 + kRounding));
    // The scan misses its minimum by at most half a step: cost'' / 2 (limit / 2000)^2 with cost'' / 2 = energy of q.
    const double energy =
        (problem.weights.array() * (problem.target * q).array().abs2()).sum() + (problem.outside * q).squaredNorm();
    EXPECT_GE(reached, best - energy * std::pow(limit / 2000.0, 2) * (1.0 + 1e-9) - kRounding * best);
  }
  EXPECT_GT(at_the_limit, 2);
  EXPECT_GT(inside, 2);
}

TEST(SkinProblem, BestLevelOfWhatMakesNoField) {
  SkinProblem problem = random_problem(3, 2, 4, 0.5, 50);
  EXPECT_EQ(best_level(problem, Eigen::VectorXcd::Zero(4)), 1.0);
  problem.target.setZero();
  problem.outside.setZero();
  EXPECT_EQ(best_level(problem, Eigen::VectorXcd::Constant(4, 0.5)), 1.0);
  EXPECT_EQ(best_level(problem, Eigen::VectorXcd::Constant(4, 4.0)), 0.25);
}

TEST(SkinProblem, AValueThatIsNotFiniteOrNegativeIsRefused) {
  const SkinProblem good = random_problem(3, 2, 4, 0.5, 60);
  EXPECT_NO_THROW(require_valid(good, "test"));
  for (const double wrong : {std::numeric_limits<double>::quiet_NaN(), -1e-9}) {
    std::vector<SkinProblem> bad(3, good);
    bad[0].amplitudes(2) = wrong;
    bad[1].weights(1) = wrong;
    bad[2].target(1, 2) = bad[2].outside(1, 3) = std::sqrt(wrong);
    for (const SkinProblem& problem : bad) EXPECT_THROW(require_valid(problem, "test"), std::invalid_argument);
  }
}

}  // namespace touchfield::skin_problem_test
