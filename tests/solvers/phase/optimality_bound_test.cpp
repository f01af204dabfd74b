#include "solvers/phase/optimality_bound.h"

#include <numbers>

#include <Eigen/QR>
#include <gtest/gtest.h>

#include "solvers/phase/skin_problem.h"
#include "solvers/phase/surface.h"
#include "tests/support/skin_support.h"

namespace touchfield::optimality_bound_test {

constexpr double kTolerance = 1e-4;  // what prove_bound leaves missing by default, as a share of the bound

/// The least cost of surface from some random starts.
double least_found(const SkinProblem& problem, unsigned starts) {
  double least = std::numeric_limits<double>::infinity();
  for (unsigned seed = 0; seed < starts; ++seed) {
    const SurfaceOptions options{.iterations = 200};
    const Eigen::VectorXcd start = random_start(problem.channel_count(), seed);
    least = std::min(least, solve_surface(problem, start, options).cost_history.back());
  }
  return least;
}

/// The least cost over a grid of phases, the first of which is 0, and of common levels.
double exhaustive(const SkinProblem& problem, int steps) {
  Eigen::VectorXcd q = Eigen::VectorXcd::Ones(problem.channel_count());
  double least = std::numeric_limits<double>::infinity();
  const auto total = static_cast<long>(std::pow(steps, q.size() - 1) + 0.5);
  for (long i = 0; i < total; ++i) {
    long rest = i;
    for (Eigen::Index n = 1; n < q.size(); ++n, rest /= steps) {
      q(n) = std::polar(1.0, 2.0 * std::numbers::pi * static_cast<double>(rest % steps) / steps);
    }
    least = std::min(least, skin_cost(problem, q));
  }
  return least;
}

TEST(OptimalityBound, LiesBelowAnExhaustiveSearchAndOftenMeetsIt) {
  int met = 0;
  for (unsigned seed = 0; seed < 12; ++seed) {
    const SkinProblem problem = random_problem(3, 2, 4, 0.8, 900 + seed);
    const double least = exhaustive(problem, 60);
    const OptimalityBound optimality_bound = prove_bound(problem);
    EXPECT_TRUE(optimality_bound.converged);
    EXPECT_LE(optimality_bound.bound, least) << seed;
    EXPECT_GE(optimality_bound.bound, 0.0);
    // The grid is 6 degrees wide, so that its own least cost is some per mille of silence above the true one.
    met += least - optimality_bound.bound < 0.01 * silent_cost(problem) ? 1 : 0;
  }
  EXPECT_GE(met, 8);  // the relaxation is often, not always, tight
}

/// 55 rows against 70 channels, R falling by `decades`: fewer dimensions will do.
SkinProblem reducible(double level, double decades, unsigned seed) {
  SkinProblem problem = random_problem(15, 40, 70, level, seed);
  const Eigen::HouseholderQR<Eigen::MatrixXcd> qr(problem.outside.adjoint());
  const Eigen::MatrixXcd basis = qr.householderQ() * Eigen::MatrixXcd::Identity(70, 40);
  const Eigen::VectorXd strengths =
      Eigen::VectorXd::LinSpaced(40, 1.0, 1.0 - decades).unaryExpr([](double x) { return std::pow(10.0, x); });
  problem.outside = strengths.asDiagonal() * basis.adjoint();
  return problem;
}

TEST(OptimalityBound, WhatItLeavesOutStaysWithinTheTolerance) {
  for (const double decades : {2.0, 5.0}) {
    for (unsigned seed = 0; seed < 2; ++seed) {
      for (const double level : {0.3, 0.8}) {
        const SkinProblem problem = reducible(level, decades, 1100 + seed);
        OptimalityBoundOptions options{.max_iterations = 200, .tolerance = 1e-2};
        const OptimalityBound rough = prove_bound(problem, options);
        options.tolerance = 1e-4;
        const OptimalityBound fine = prove_bound(problem, options);
        const double least = 1e-4 * silent_cost(problem);  // the tolerance is a share of no less
        ASSERT_TRUE(rough.converged) << level << " " << decades << " " << seed;
        EXPECT_LE(rough.bound, fine.relaxed * (1.0 + 1e-12));
        EXPECT_LE(fine.bound, rough.relaxed * (1.0 + 1e-12));
        EXPECT_GE(rough.bound, rough.relaxed - 1e-2 * std::max(rough.relaxed, least));
        if (fine.converged) {
          EXPECT_GE(fine.bound, fine.relaxed - 1e-4 * std::max(fine.relaxed, least));
        }
      }
    }
  }
}

TEST(OptimalityBound, HoldsForDrivesThatAreNotFull) {
  for (unsigned seed = 0; seed < 4; ++seed) {
    // More outside rows than channels: whatever is sent presses on the skin outside the target too, and less than full
    // drive is best.
    SkinProblem problem = random_problem(4, 24, 20, 0.5, 940 + seed);
    problem.outside *= 3.0;
    const OptimalityBound optimality_bound = prove_bound(problem);
    EXPECT_TRUE(optimality_bound.converged);
    double least = std::numeric_limits<double>::infinity();
    const SurfaceOptions options{.iterations = 300, .free_amplitudes = true};
    for (unsigned start = 0; start < 5; ++start) {
      const PhaseSolution solution = solve_surface(problem, random_start(20, start), options);
      EXPECT_LE(optimality_bound.bound, solution.cost_history.back());
      EXPECT_LT(solution.amplitudes.mean(), 0.9);  // or the test would say nothing
      least = std::min(least, solution.cost_history.back());
    }
    EXPECT_GT(optimality_bound.bound, 0.9 * least) << seed;  // 0 if full drives alone were relaxed
  }
}

TEST(OptimalityBound, IsABoundWhereverItStops) {
  const SkinProblem problem = random_problem(8, 5, 50, 0.8, 970);
  const double least = least_found(problem, 10);
  double before = 0.0;
  for (const int iterations : {0, 1, 2, 4, 8, 60}) {
    const OptimalityBoundOptions options{.max_iterations = iterations};
    const OptimalityBound optimality_bound = prove_bound(problem, options);
    EXPECT_LE(optimality_bound.bound, least) << iterations;
    EXPECT_GE(optimality_bound.bound, before) << iterations;  // the best of the way is kept
    EXPECT_LE(optimality_bound.iterations, iterations);
    before = optimality_bound.bound;
  }
  EXPECT_GT(before, 0.8 * least);
}

TEST(OptimalityBound, CountsFacesThatNothingReachesAndThoseThatWantSilence) {
  const SkinProblem problem = random_problem(4, 2, 20, 0.9, 990);
  const double bound = prove_bound(problem).bound;
  SkinProblem more = problem;
  more.target.conservativeResize(5, Eigen::NoChange);
  more.target.row(4).setZero();
  more.amplitudes.conservativeResize(5);
  more.weights.conservativeResize(5);
  more.amplitudes(4) = 3.0;
  more.weights(4) = 2.0;
  EXPECT_NEAR(prove_bound(more).bound, bound + 18.0, 2.0 * kTolerance * (bound + 18.0));
  // A face that wants silence is a row of the skin outside.
  more = problem;
  more.amplitudes(2) = 0.0;
  SkinProblem moved = problem;
  moved.target = problem.target({0, 1, 3}, Eigen::all);
  moved.amplitudes = problem.amplitudes({0, 1, 3});
  moved.weights = problem.weights({0, 1, 3});
  moved.outside.resize(3, 20);
  moved.outside << problem.outside, std::sqrt(problem.weights(2)) * problem.target.row(2);
  EXPECT_NEAR(prove_bound(more).bound / prove_bound(moved).bound, 1.0, 2.0 * kTolerance);
  more.amplitudes.setZero();
  EXPECT_EQ(prove_bound(more).bound, 0.0);
}

TEST(OptimalityBound, StandsOddProblems) {
  const Eigen::Index channels = 12;
  SkinProblem problem = random_problem(40, 6, channels, 0.8, 1000);  // K > N
  EXPECT_LE(prove_bound(problem).bound, least_found(problem, 10));
  problem = random_problem(3, 0, channels, 0.8, 1001);
  problem.target.col(4) = problem.target.col(5);  // coincident transducers
  problem.target.col(6).setZero();
  EXPECT_LE(prove_bound(problem).bound, least_found(problem, 10));
  problem.amplitudes.setConstant(1e6);
  const double least = least_found(problem, 5);
  EXPECT_LE(prove_bound(problem).bound, least);
  EXPECT_GT(prove_bound(problem).bound, 0.999 * least);  // all it can, and still far from enough
  problem = random_problem(3, 4, channels, 0.8, 1002);
  problem.target.row(1) *= 1e-7;  // in deep shadow
  problem.outside.row(3) *= 1e-7;
  const double shadowed = least_found(problem, 20);
  EXPECT_LE(prove_bound(problem).bound, shadowed);
  EXPECT_GT(prove_bound(problem).bound, 0.9 * shadowed);  // 0.99; two thirds of it is the shadowed face alone
  problem.target.setZero();
  problem.outside.resize(0, channels);
  EXPECT_NEAR(prove_bound(problem).bound / silent_cost(problem), 1.0, 1e-12);
}

/// A problem whose least cost is known: one drive is heard by every face as loudly as can be, still less than wanted,
/// and leaves the outside rows silent.
struct KnownProblem {
  SkinProblem problem;
  double least = 0.0;
};

/// loudness   of the outside rows
/// decades    over which their loudness falls
KnownProblem known_problem(Eigen::Index faces, Eigen::Index rows, Eigen::Index channels, double loudness,
                           double decades, unsigned seed) {
  Uniform uniform(seed);
  Eigen::VectorXcd best(channels);
  for (std::complex<double>& drive : best) drive = std::polar(1.0, uniform(-3.14, 3.14));
  KnownProblem known{random_problem(faces, rows, channels, 0.5, seed), 0.0};
  SkinProblem& problem = known.problem;
  for (Eigen::Index j = 0; j < faces; ++j) {
    const Eigen::VectorXd heard = problem.target.row(j).cwiseAbs();
    problem.target.row(j) = heard.cwiseProduct(best.conjugate()).transpose();
    const double missing = uniform(0.1, 1.0) * heard.sum();
    problem.amplitudes(j) = heard.sum() + missing;
    known.least += problem.weights(j) * missing * missing;
  }
  problem.outside -= problem.outside * best * best.adjoint() / static_cast<double>(channels);
  for (Eigen::Index i = 0; i < rows; ++i) {
    const double share = static_cast<double>(i) / static_cast<double>(rows);
    problem.outside.row(i) *= loudness * std::pow(10.0, -decades * share);
  }
  return known;
}

// In the sizes between an exhaustive search and a hand, with rows that may be left out and without.
TEST(OptimalityBound, MeetsAKnownLeastCost) {
  for (const double decades : {0.0, 5.0}) {
    for (const Eigen::Index channels : {60, 250}) {
      const KnownProblem known = known_problem(channels / 10, channels / 4, channels, 3.0, decades, 1200);
      const OptimalityBound optimality_bound = prove_bound(known.problem);
      EXPECT_TRUE(optimality_bound.converged) << channels << " " << decades;
      EXPECT_LE(optimality_bound.bound, known.least) << channels << " " << decades;
      EXPECT_GE(optimality_bound.bound, (1.0 - 2.0 * kTolerance) * known.least) << channels << " " << decades;
    }
  }
}

// Outside rows so large that S in double knows its eigenvalues to no better than eps |R|^2 / N: a bound nearer to the
// least cost than N times that counts on roundings that nobody has proved.
TEST(OptimalityBound, GivesUpWhatRoundingMayHide) {
  for (unsigned seed = 0; seed < 4; ++seed) {
    const KnownProblem known = known_problem(2, 7, 8, 1e5, 0.0, 1300 + seed);
    const double hidden = std::numeric_limits<double>::epsilon() * known.problem.outside.squaredNorm();
    ASSERT_GT(hidden, 1e-7 * known.least);  // or other roundings would do
    const OptimalityBoundOptions options{.max_iterations = 100, .tolerance = 1e-12};
    const double bound = prove_bound(known.problem, options).bound;
    EXPECT_LE(bound, known.least - hidden) << seed;
    EXPECT_GE(bound, known.least - 1e4 * hidden) << seed;  // 16 N (2 N + 16) or so
  }
}

TEST(OptimalityBound, GapIsAShareOfTheBound) {
  const SkinProblem problem = random_problem(2, 0, 5, 1.5, 1010);
  OptimalityBound optimality_bound;
  optimality_bound.bound = 0.5 * silent_cost(problem);
  EXPECT_DOUBLE_EQ(optimality_gap(optimality_bound, 0.6 * silent_cost(problem), silent_cost(problem)), 0.2);
  optimality_bound.bound = 1e-10 * silent_cost(problem);
  EXPECT_TRUE(std::isnan(optimality_gap(optimality_bound, 0.6, silent_cost(problem))));
}

}  // namespace touchfield::optimality_bound_test
