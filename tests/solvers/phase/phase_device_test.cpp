#include "solvers/phase/phase_device.h"

#include <stdexcept>

#include <gtest/gtest.h>

#include "solvers/phase/baselines.h"
#include "solvers/phase/incident_problem.h"
#include "solvers/phase/optimality_bound.h"
#include "solvers/phase/skin_jacobian.h"
#include "solvers/phase/skin_problem.h"
#include "solvers/phase/surface.h"
#include "tests/support/fake_phase_device.h"
#include "tests/support/skin_support.h"

namespace touchfield::phase_device_test {

SkinProblem moved(SkinProblem problem) {
  FakePhaseDevice device;
  move_to(device, problem);
  return problem;
}

const FakeSkinDevice& device_of(const SkinProblem& problem) {
  return dynamic_cast<const FakeSkinDevice&>(*problem.device);
}

/// More rows than columns and fewer, with and without outside rows.
std::vector<SkinProblem> problems() {
  return {random_problem(6, 0, 30, 0.3, 1), random_problem(20, 15, 90, 0.3, 2), random_problem(30, 40, 24, 0.3, 3),
          random_problem(1, 0, 1, 0.3, 4)};
}

void expect_same(const PhaseSolution& one, const PhaseSolution& other, double tolerance) {
  const double scale = one.cost_history.front();
  EXPECT_NEAR(one.cost_history.back(), other.cost_history.back(), tolerance * scale);
  EXPECT_LT((drive(one) - drive(other)).norm(), 1e3 * tolerance * std::sqrt(static_cast<double>(one.phases.size())));
}

TEST(PhaseDevice, TakesTheProductsAndStepsOfSurface) {
  for (const SkinProblem& problem : problems()) {
    const SkinProblem on_device = moved(problem);
    const Eigen::VectorXcd start = random_start(problem.channel_count(), 1);
    for (const bool free : {false, true}) {
      const SurfaceOptions options{.iterations = 8, .free_amplitudes = free};
      expect_same(solve_surface(problem, start, options), solve_surface(on_device, start, options), 1e-6);
    }
    if (problem.channel_count() > 1) {
      EXPECT_GT(device_of(on_device).sent, 10);
      EXPECT_GT(device_of(on_device).sent_back, 4);
      EXPECT_GT(device_of(on_device).in_single, 4);
    }
  }
}

TEST(PhaseDevice, TakesAnnealedStartsAndTheSearch) {
  const SkinProblem problem = random_problem(12, 8, 80, 0.3, 6);
  const SkinProblem on_device = moved(problem);
  const Eigen::VectorXcd annealed = annealed_start(problem);
  // In single precision, whose rounding grows along the way.
  EXPECT_LT((annealed_start(on_device) - annealed).norm(), 1e-3 * annealed.norm());
  const SkinProblem trapped = random_problem(30, 10, 24, 0.3, 34);
  const PhaseSolution found = search_surface(trapped, Eigen::MatrixXcd(24, 0), {});
  const PhaseSolution there = search_surface(moved(trapped), Eigen::MatrixXcd(24, 0), {});
  // Annealing in single precision may end in another trap as good.
  EXPECT_NEAR(found.cost_history.back(), there.cost_history.back(), 0.05 * found.cost_history.back());
}

TEST(PhaseDevice, TakesBaselinesAndTheBoundWithoutSilentChannels) {
  SkinProblem problem = random_problem(8, 5, 20, 0.3, 7);
  problem.target.col(3).setZero();
  problem.outside.col(3).setZero();
  const SkinProblem on_device = moved(problem);
  const BaselineOptions options{.iterations = 10};
  const Eigen::VectorXcd start = random_start(20, 3);
  EXPECT_NEAR(solve_lbfgs(problem, start, options).cost_history.back(),
              solve_lbfgs(on_device, start, options).cost_history.back(), 1e-6 * silent_cost(problem));
  const double bound = prove_bound(problem, {}).bound;
  EXPECT_NEAR(prove_bound(on_device, {}).bound, bound, 1e-3 * bound);
}

// J J^T of two equal rows is singular but for a damping that single precision does not see.
TEST(PhaseDevice, AsksForDoubleWhereSinglePrecisionFails) {
  SkinProblem problem = random_problem(4, 0, 30, 0.3, 8);
  problem.target.row(1) = problem.target.row(0);
  problem.weights(1) = problem.weights(0);
  const SkinProblem on_device = moved(problem);
  std::vector<Eigen::VectorXd> steps;
  for (const SkinProblem* of : {&std::as_const(problem), &on_device}) {
    SkinJacobian jacobian(*of);
    SkinField field;
    const Eigen::VectorXcd q = random_start(30, 4);
    send(*of, q, field);
    jacobian.set(field, q);
    jacobian.set_radial({2, 7});
    DampedStep step;
    const double mu = 1e-10 * jacobian.largest_row();
    EXPECT_TRUE(step.solve(jacobian, Eigen::VectorXd::Constant(32, mu), steps.emplace_back()));
    EXPECT_EQ(step.double_count(), 1);
    Eigen::VectorXd again;
    EXPECT_TRUE(step.solve_again(jacobian, jacobian.residual(), again));
    EXPECT_LT((again - steps.back()).norm(), 1e-6 * again.norm());
  }
  EXPECT_LT((steps[0] - steps[1]).norm(), 1e-4 * steps[0].norm());
  EXPECT_EQ(device_of(on_device).in_double, 1);
}

IncidentProblem incident(Eigen::Index rows, Eigen::Index unknowns, Eigen::Index targets, unsigned seed) {
  Uniform uniform(seed);
  const Eigen::MatrixXcd c = random_matrix(rows, unknowns, uniform);
  return {c.adjoint() * c, targets};
}

std::shared_ptr<GramDevice> faked(const Eigen::MatrixXcd& q) {
  return std::make_shared<FakeGramDevice>(q.data(), static_cast<int>(q.rows()));
}

TEST(PhaseDevice, TakesTheStepsOfPaper) {
  for (const double damping : {1e-3, 1e-7}) {
    const IncidentProblem problem = incident(30, 40, 10, 10);
    const IncidentProblem on_device{{}, problem.target_count, faked(problem.gram)};
    const LevenbergMarquardtOptions options{.iterations = 5, .initial_damping = damping};
    const Eigen::VectorXd start = Eigen::VectorXd::Zero(40);
    const PhaseSolution expected = solve_incident(problem, start, options);
    const PhaseSolution found = solve_incident(on_device, start, options);
    for (std::size_t i = 0; i < expected.cost_history.size(); ++i) {
      EXPECT_NEAR(found.cost_history.at(i), expected.cost_history[i], 1e-6 * expected.cost_history[0]);
    }
    EXPECT_EQ(found.phases.size(), 30);
  }
  IncidentProblem bad = incident(30, 8, 3, 11);
  bad.gram(1, 1) = std::numeric_limits<double>::infinity();
  bad.device = faked(bad.gram);
  EXPECT_THROW(solve_incident(bad, Eigen::VectorXd::Zero(8), {}), std::invalid_argument);
}

}  // namespace touchfield::phase_device_test
