#include "solvers/phase/phase_descent.h"

#include <gtest/gtest.h>

#include "solvers/phase/skin_problem.h"
#include "solvers/phase/surface.h"
#include "tests/support/skin_support.h"

namespace touchfield::phase_descent_test {

/// The same problem, known by products: the outside rows are faces of weight 1 where nothing is wanted.
MappedSkin mapped(const SkinProblem& problem) {
  const Eigen::Index rank = problem.outside.rows();
  Eigen::MatrixXcf h(problem.target_count() + rank, problem.channel_count());
  h << problem.target.cast<std::complex<float>>(), problem.outside.cast<std::complex<float>>();
  MappedSkin skin{{[h](const Eigen::VectorXcf& q) -> Eigen::VectorXcf { return h * q; },
                   [h](const Eigen::VectorXcf& v) -> Eigen::VectorXcf { return h.adjoint() * v; }},
                  Eigen::VectorXd::Zero(h.rows()),
                  Eigen::VectorXd::Ones(h.rows())};
  skin.amplitudes.head(problem.target_count()) = problem.amplitudes;
  skin.weights.head(problem.target_count()) = problem.weights;
  return skin;
}

Eigen::VectorXd zero(const SkinProblem& problem) { return Eigen::VectorXd::Zero(problem.channel_count()); }

TEST(PhaseDescent, ItsCostIsThatOfTheSkinProblemAndFallsToWhatLevenbergMarquardtReaches) {
  const SkinProblem problem = random_problem(6, 8, 60, 0.4, 5);
  PhaseDescent descent;
  const PhaseSolution found = descent.descend(mapped(problem), zero(problem), 300, false);
  ASSERT_EQ(found.cost_history.size(), static_cast<std::size_t>(found.iterations) + 1);
  for (std::size_t i = 1; i < found.cost_history.size(); ++i) {
    EXPECT_LE(found.cost_history[i], found.cost_history[i - 1]);
  }
  const double silent = silent_cost(problem);  // single precision leaves a few 1e-7 of it
  EXPECT_NEAR(found.cost_history.front(), skin_cost(problem, Eigen::VectorXcd::Ones(60)), 1e-5 * silent);
  EXPECT_NEAR(found.cost_history.back(), skin_cost(problem, drive(found)), 1e-5 * silent);
  const PhaseSolution best = solve_surface(problem, Eigen::VectorXcd::Ones(60), {.iterations = 300});
  EXPECT_LT(found.cost_history.back(), best.cost_history.back() + 0.02 * silent);
}

TEST(PhaseDescent, AnArrayThatIsTooStrongIsTurnedDownToTheBestLevel) {
  const SkinProblem problem = random_problem(4, 30, 10, 0.01, 8);  // more faces than drives: none can be silent
  PhaseDescent descent;
  const PhaseSolution found = descent.descend(mapped(problem), zero(problem), 30, true);
  const double level = found.amplitudes(0);
  EXPECT_LT(level, 1.0);
  EXPECT_EQ(found.amplitudes, Eigen::VectorXd::Constant(10, level));
  const Eigen::VectorXcd phasors = drive(found) / level;
  EXPECT_NEAR(level, best_level(problem, phasors), 1e-5);
  EXPECT_NEAR(found.cost_history.back(), skin_cost(problem, drive(found)), 1e-5 * silent_cost(problem));
}

// From phases that are best at a level below 1, full drive would leave them.
TEST(PhaseDescent, PhasesThatAreBestAtALowerLevelStay) {
  const SkinProblem problem = random_problem(4, 30, 40, 0.02, 8);
  const PhaseSolution best =
      solve_surface(problem, Eigen::VectorXcd::Constant(40, 0.5), {.iterations = 300, .free_level = true});
  ASSERT_LT(best.amplitudes(0), 1.0);
  const PhaseSolution found = PhaseDescent().descend(mapped(problem), best.phases, 10, true);
  EXPECT_LT(found.cost_history.back(), (1 + 1e-4) * best.cost_history.back());
}

TEST(PhaseDescent, APressureThatIsNotFiniteIsAnError) {
  SkinProblem problem = random_problem(3, 0, 20, 0.4, 9);
  problem.target(1, 2) = std::numeric_limits<double>::quiet_NaN();
  PhaseDescent descent;
  EXPECT_THROW(descent.descend(mapped(problem), zero(problem), 10, false), std::domain_error);
}

// Each problem differs from the one before by 1 % of its entries.
TEST(PhaseDescent, ItsMemoryServesTheNextProblems) {
  const SkinProblem from = random_problem(12, 30, 80, 0.5, 6);
  const SkinProblem to = random_problem(12, 30, 80, 0.5, 7);
  PhaseDescent remembering;
  Eigen::VectorXd with = remembering.descend(mapped(from), zero(from), 200, false).phases;
  Eigen::VectorXd without = with;
  double remembered = 0;
  double forgotten = 0;
  for (int i = 1; i <= 20; ++i) {
    SkinProblem problem = from;
    problem.target += 0.01 * i * (to.target - from.target);
    problem.outside += 0.01 * i * (to.outside - from.outside);
    const PhaseSolution a = remembering.descend(mapped(problem), with, 3, false);
    const PhaseSolution b = PhaseDescent().descend(mapped(problem), without, 3, false);
    with = a.phases;
    without = b.phases;
    remembered += a.cost_history.back();
    forgotten += b.cost_history.back();
  }
  EXPECT_LT(remembered, forgotten);
}

}  // namespace touchfield::phase_descent_test
