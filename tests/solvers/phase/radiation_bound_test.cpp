#include "solvers/phase/radiation_bound.h"

#include <gtest/gtest.h>

#include "solvers/phase/surface.h"
#include "tests/support/radiation_support.h"

namespace touchfield::radiation_bound_test {

constexpr OptimalityBoundOptions kFine{.width = 3, .max_iterations = 400, .tolerance = 1e-7};

/// The bound from some random start.
OptimalityBound proved(const RadiationProblem& problem, const OptimalityBoundOptions& options = kUsualRadiationBound) {
  return prove_radiation_bound(problem, random_start(problem.channel_count(), 77), options);
}

/// The least radiation_cost of descents from random starts.
double least_found(const RadiationProblem& problem, unsigned starts, const RadiationOptions& options) {
  double least = std::numeric_limits<double>::infinity();
  for (unsigned seed = 0; seed < starts; ++seed) {
    const PhaseSolution found = solve_radiation(problem, random_start(problem.channel_count(), seed), options);
    least = std::min(least, radiation_cost(problem, drive(found)));
  }
  return least;
}

// One drive presses every face as hard as can be, still less than wanted, and leaves the skin outside silent.
TEST(RadiationBound, MeetsAKnownLeastCost) {
  constexpr Eigen::Index kChannels = 60;
  RadiationProblem problem = random_radiation_problem(12, 0, 20, kChannels, 0.3, 50);
  problem.skin.flow = 0.0;
  const Eigen::VectorXcd best = random_start(kChannels, 51);
  problem.rows = problem.rows.cwiseAbs().cast<std::complex<double>>() * best.conjugate().asDiagonal();
  problem.outside -= problem.outside * best * best.adjoint() / static_cast<double>(kChannels);
  problem.skin.wanted = 1.5 * problem.skin.press * problem.rows.cwiseAbs().rowwise().sum().cwiseAbs2();
  const double least = radiation_cost(problem, best);
  const OptimalityBound bound = proved(problem);
  EXPECT_TRUE(bound.converged);
  EXPECT_LE(bound.bound, least * (1.0 + 1e-12));
  EXPECT_GE(bound.bound, 0.99 * least);
  EXPECT_GE(proved(problem, kFine).bound, (1.0 - 1e-6) * least);
}

TEST(RadiationBound, HoldsForEveryFreedomAndWithTolerances) {
  for (const double wanted : {0.04, 0.3}) {  // less than full drive presses, and more
    const RadiationProblem problem = random_radiation_problem(40, 8, 4, 24, wanted, 60);
    const RadiationProblem spread = with_tolerances(problem, {.phase = 0.4, .gain = 0.1});
    for (const RadiationProblem* each : {&problem, &spread}) {
      const double bound = proved(*each).bound;
      for (const bool level : {false, true}) {
        for (const bool amplitudes : {false, true}) {
          const RadiationOptions options{.iterations = 100, .free_amplitudes = amplitudes, .free_level = level};
          const double least = least_found(*each, 5, options);
          EXPECT_LE(bound, least) << wanted << level << amplitudes;
        }
      }
    }
  }
}

/// One channel: a parabola in |q|^2, which is free up to 1.
TEST(RadiationBound, IsExactForASingleChannel) {
  for (const double level : {0.3, 3.0}) {  // more and less than full drive does
    for (unsigned seed = 0; seed < 4; ++seed) {
      const RadiationProblem problem = random_radiation_problem(3, 2, 2, 1, level, 80 + seed);
      const auto cost = [&](double share) {
        return radiation_cost(problem, Eigen::VectorXcd::Constant(1, std::sqrt(share)));
      };
      const double curvature = 2.0 * (cost(1.0) - 2.0 * cost(0.5) + cost(0.0));
      const double slope = cost(1.0) - cost(0.0) - curvature;
      const double least = cost(std::clamp(-0.5 * slope / curvature, 0.0, 1.0));
      EXPECT_LE(proved(problem, kFine).bound, least * (1.0 + 1e-12));
      EXPECT_NEAR(proved(problem, kFine).bound, least, 1e-6 * least) << level << seed;
    }
  }
}

TEST(RadiationBound, IsTheConstantWhereNothingIsWanted) {
  RadiationProblem problem = random_radiation_problem(6, 2, 3, 20, 0.3, 95);
  problem.skin.wanted.setZero();
  EXPECT_EQ(proved(problem).bound, 0.0);
  problem.skin.constant = 0.25;
  EXPECT_EQ(proved(problem).bound, 0.25);
  problem = random_radiation_problem(6, 2, 3, 20, 0.3, 95);
  problem.rows.setZero();
  problem.outside.setZero();
  EXPECT_NEAR(proved(problem).bound, silent_cost(problem.skin), 1e-2 * silent_cost(problem.skin));
  EXPECT_LE(proved(problem).bound, silent_cost(problem.skin));
}

// Residuals and diagonal from wherever the descent stops, at random points too.
TEST(RadiationBound, IsABoundWhateverTheDualPoint) {
  const RadiationProblem problem = random_radiation_problem(40, 8, 4, 24, 0.3, 100);
  const double least = least_found(problem, 20, {.iterations = 100});
  double best = 0.0;
  for (const int iterations : {0, 1, 2, 5, 10, 20, 120}) {
    for (unsigned seed = 1; seed < 6; ++seed) {
      const OptimalityBound bound =
          proved(problem,
                 {.width = 2 + static_cast<int>(seed), .max_iterations = iterations, .tolerance = 0.01, .seed = seed});
      EXPECT_LE(bound.bound, least) << iterations << " " << seed;
      EXPECT_LE(bound.iterations, iterations);
      best = std::max(best, bound.bound);
    }
  }
  EXPECT_GT(best, 0.85 * least);
}

// A face that cannot be pressed as hard as wanted, by drives that leave the skin outside silent. Its energy is so large
// that C in double knows its eigenvalues to no better than eps e |R|^2 / N.
TEST(RadiationBound, GivesUpWhatRoundingMayHide) {
  constexpr Eigen::Index kChannels = 8;
  for (unsigned seed = 0; seed < 4; ++seed) {
    RadiationProblem problem = random_radiation_problem(1, 0, 7, kChannels, 1.0, 110 + seed);
    problem.skin.flow = 0.0;
    const Eigen::VectorXcd best = phasors_of(problem.rows.row(0).adjoint());
    problem.outside -= problem.outside * best * best.adjoint() / static_cast<double>(kChannels);
    const double most = problem.skin.press * std::pow(problem.rows.cwiseAbs().sum(), 2);
    problem.skin.wanted(0) = 1.5 * most;
    problem.skin.energies.tail(7).setConstant(1e10 * most);
    const double least = problem.skin.weights(0) * std::pow(0.5 * most, 2);
    const double hidden = std::numeric_limits<double>::epsilon() * 1e10 * most * problem.outside.squaredNorm();
    const double bound = prove_radiation_bound(problem, best, kFine).bound;
    EXPECT_LE(bound, least - hidden) << seed;
  }
}

}  // namespace touchfield::radiation_bound_test
