#include <gtest/gtest.h>

#include "solvers/phase/skin_problem.h"
#include "solvers/phase/surface.h"
#include "tests/support/skin_support.h"
#include "tests/support/threads_support.h"

namespace touchfield::surface_search_test {

/// More faces than channels can serve: single starts end in different traps.
SkinProblem trapped(unsigned seed) { return random_problem(60, 20, 48, 0.3, seed); }

double reached(const PhaseSolution& solution) { return solution.cost_history.back(); }

TEST(AnnealedStart, IsOfTheLevelAskedForAndFarBelowChance) {
  for (const double level : {1.0, 0.2}) {
    for (unsigned seed = 1; seed <= 5; ++seed) {
      SkinProblem problem = trapped(seed);
      problem.amplitudes *= level;
      const Eigen::VectorXcd q = annealed_start(problem, {.level = level});
      EXPECT_LT((q.array().abs() - level).abs().maxCoeff(), 1e-6);
      double chance = 1e300;
      for (unsigned i = 0; i < 20; ++i) {
        chance = std::min(chance, skin_cost(problem, level * random_start(problem.channel_count(), i)));
      }
      EXPECT_LT(skin_cost(problem, q), 0.6 * chance) << "problem " << seed << ", level " << level;
    }
  }
}

TEST(AnnealedStart, UnitsAndTheNumberOfThreadsChangeNothing) {
  const SkinProblem problem = trapped(3);
  const Eigen::VectorXcd q = annealed_start(problem);
  SkinProblem other = problem;
  other.target *= 1024.0;  // powers of two, which round alike
  other.outside *= 1024.0;
  other.amplitudes *= 1024.0;
  EXPECT_EQ(annealed_start(other), q);
  for (const int threads : {1, 3}) {
    EXPECT_EQ(with_threads(threads, [&] { return annealed_start(problem); }), q);
  }
}

TEST(AnnealedStart, TheLevelIsBelowOneOnlyWhereTheArrayIsFarTooStrong) {
  SkinProblem problem = trapped(5);
  EXPECT_DOUBLE_EQ(annealed_starts(problem, true).level, 1.0);
  problem.amplitudes *= 0.02;
  const double level = annealed_starts(problem, true).level;
  EXPECT_LT(level, 0.2);
  EXPECT_NEAR(best_level(problem, annealed_start(problem, {.level = level})), 1.0, 0.12);
}

TEST(SurfaceSearch, EndsBelowWhatSingleStartsReachOnAverage) {
  double searched = 0.0;
  double single = 0.0;
  for (unsigned seed = 1; seed <= 6; ++seed) {
    const SkinProblem problem = trapped(seed);
    const double cost = reached(search_surface(problem, Eigen::MatrixXcd(48, 0), {}));
    searched += cost;
    for (unsigned start = 1; start <= 4; ++start) {
      single += 0.25 * reached(solve_surface(problem, random_start(48, start), {}));
    }
  }
  EXPECT_LT(searched, 0.99 * single);
}

TEST(SurfaceSearch, KeepsAStartThatIsBetterThanItsOwn) {
  const SkinProblem problem = trapped(7);
  PhaseSolution best;
  for (unsigned start = 1; start <= 10; ++start) {
    const SurfaceOptions options{.iterations = 200};
    PhaseSolution solution = solve_surface(problem, random_start(48, start), options);
    if (best.cost_history.empty() || reached(solution) < reached(best)) best = std::move(solution);
  }
  const PhaseSolution found = search_surface(problem, drive(best), {});
  EXPECT_LE(reached(found), reached(best) * (1.0 + 1e-12));
}

TEST(SurfaceSearch, TurnsAnArrayDownThatIsFarTooStrong) {
  SkinProblem problem = trapped(8);
  problem.amplitudes *= 0.02;
  const Eigen::MatrixXcd none(48, 0);
  const PhaseSolution full = search_surface(problem, none, {});
  const SurfaceOptions options{.free_level = true};
  const PhaseSolution reduced = search_surface(problem, none, options);
  EXPECT_TRUE((full.amplitudes.array() == 1.0).all());
  EXPECT_EQ(reduced.amplitudes.minCoeff(), reduced.amplitudes.maxCoeff());
  EXPECT_LT(reduced.amplitudes(0), 0.2);
  EXPECT_LT(reached(reduced), 0.5 * reached(full));
  EXPECT_NEAR(reached(reduced), skin_cost(problem, drive(reduced)), 1e-12 * reached(reduced));
  EXPECT_NEAR(best_level(problem, drive(reduced)), 1.0, 1e-9);
}

// Eleven rows and 30 free amplitudes: a weak pattern can be made exactly, and the search finds it.
TEST(SurfaceSearch, FreeAmplitudesMakeAWeakPatternExactly) {
  SkinProblem problem = random_problem(5, 6, 30, 0.3, 860);
  problem.amplitudes *= 1e-3;
  const SurfaceOptions options{.free_amplitudes = true};
  const PhaseSolution found = search_surface(problem, Eigen::MatrixXcd(30, 0), options);
  EXPECT_LT(found.cost_history.back(), 1e-6 * skin_cost(problem, Eigen::VectorXcd::Zero(30)));
}

}  // namespace touchfield::surface_search_test
