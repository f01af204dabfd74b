#include <gtest/gtest.h>

#include "sim/bem/scattering_solver.h"
#include "sim/run/estimates.h"
#include "tests/support/solve_support.h"

namespace touchfield::expected_steps_test {

TEST(ExpectedSteps, ASmallBodyAndAPlainSchemeGetTheUsualOnes) {
  const Model model = small_model();
  EXPECT_EQ(expected_steps(model, Scheme::kBurtonMillerPolished), 25);
  EXPECT_EQ(expected_steps(model, Scheme::kPaper), 200);
}

TEST(ExpectedSteps, OfALargeBodyAreNearThoseThatGmresTakes) {
  const Model model =
      small_model({"body={sphere: {radius_mm: 45}, place: {landmark: bottom, at_mm: [0, 0, 50]}, edge_mm: 1.9}"});
  ASSERT_GT(model.body.mesh.face_count(), 15000);
  const Scheme scheme = Scheme::kBurtonMiller;
  const ScatteringSystem system(model.body.mesh, model.fixed->wave, scheme);
  const Solved solved =
      make_solver(system, {})->solve(system.right_hand_side(system.incident(model.fixed->array, free_focus(model))));
  ASSERT_TRUE(solved.report.converged);
  const double expected = expected_steps(model, scheme);
  EXPECT_GT(expected, 0.67 * solved.report.steps);
  EXPECT_LT(expected, 1.33 * solved.report.steps);
}

}  // namespace touchfield::expected_steps_test
