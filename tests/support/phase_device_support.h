#pragma once

#include <initializer_list>
#include <vector>

#include <gtest/gtest.h>

#include "solvers/phase/phase_solution.h"
#include "solvers/phase/skin_jacobian.h"
#include "tests/support/skin_support.h"

namespace touchfield {

/// Expects that a step with two equal rows is found on the processor and on the device alike, in double: J J^T is
/// singular but for a damping that single precision does not see. Returns the problem with the device.
inline SkinProblem expect_step_in_double(PhaseDevice& device) {
  SkinProblem problem = random_problem(4, 0, 30, 0.3, 8);
  problem.target.row(1) = problem.target.row(0);
  problem.weights(1) = problem.weights(0);
  SkinProblem on_device = problem;
  move_to(device, on_device);
  std::vector<Eigen::VectorXd> steps;
  for (const SkinProblem* of : std::initializer_list<const SkinProblem*>{&problem, &on_device}) {
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
  return on_device;
}

}  // namespace touchfield
