// Solutions with products by a grid against solutions with direct products.
#include <vector>

#include <gtest/gtest.h>

#include "sim/bem/grid_spec.h"
#include "sim/bem/scattering_solver.h"
#include "sim/hand/hand.h"
#include "sim/hand/shapes.h"

namespace touchfield::grid_solver_test {

Wave wave(double absorption = 0.0) {
  Medium medium = air(293.15);
  medium.absorption = absorption;
  return {medium, 40e3};
}

Eigen::VectorXcd solve(const TriangleMesh& mesh, const Wave& wave, Scheme scheme, double grid_tolerance,
                       const SolverOptions& options) {
  SystemOptions system_options;
  system_options.grid_tolerance = grid_tolerance;
  const ScatteringSystem system(mesh, wave, scheme, system_options);
  const IncidentField field = system.incident(plane_wave(Vector3::UnitZ(), 1.0));
  const Solved solved = make_solver(system, options)->solve(system.right_hand_side(field));
  EXPECT_TRUE(solved.report.converged);
  EXPECT_LE(solved.report.residual, options.tolerance);
  return system.pressure(solved.x, field);
}

double difference(const TriangleMesh& mesh, const Wave& wave, Scheme scheme, double tolerance) {
  const Eigen::VectorXcd exact = solve(mesh, wave, scheme, 0.0, {.tolerance = 1e-6, .max_steps = 1000});
  const Eigen::VectorXcd found =
      solve(mesh, wave, scheme, 0.1 * tolerance, {.kind = SolverKind::kFft, .tolerance = tolerance, .max_steps = 1000});
  return (found - exact).norm() / exact.norm();
}

// Sound that is caught between folded fingers amplifies what a product gets wrong.
TEST(GridSolver, FoldedHandsAreSolvedAsByDirectProducts) {
  const TriangleMesh mesh = hand({.pose = "fist", .edge = 5e-3}).mesh;
  EXPECT_LT(difference(mesh, wave(), Scheme::kBurtonMillerPolished, 1e-4), 3e-4);
}

TEST(GridSolver, EverySchemeThatIteratesAndAbsorption) {
  const TriangleMesh mesh = icosphere(12e-3, 8);
  for (const Scheme scheme :
       {Scheme::kPaper, Scheme::kPaperCorrected, Scheme::kBurtonMiller, Scheme::kBurtonMillerPolished}) {
    EXPECT_LT(difference(mesh, wave(2.0), scheme, 1e-5), 3e-5) << to_string(scheme);
  }
}

// No product is taken pair by pair: the residual is that of GMRES plus the grid's error.
TEST(GridSolver, ReachesTenTimesTheToleranceOfTheFinestGrid) {
  const TriangleMesh mesh = icosphere(12e-3, 12);
  constexpr double kTolerance = 10.0 * kFinestGridTolerance;
  const Eigen::VectorXcd exact = solve(mesh, wave(), Scheme::kBurtonMiller, 0.0,
                                       {.kind = SolverKind::kLu, .precision = Precision::kDouble, .tolerance = 1e-12});
  const Eigen::VectorXcd found =
      solve(mesh, wave(), Scheme::kBurtonMiller, kFinestGridTolerance,
            {.kind = SolverKind::kFft, .refine = false, .tolerance = kTolerance, .max_steps = 1000});
  EXPECT_LT((found - exact).norm(), 3.0 * kTolerance * exact.norm());
}

// A tolerance finer than any grid's: corrections by direct products in double.
TEST(GridSolver, IsRefinedBeyondWhatItsProductsReach) {
  const TriangleMesh mesh = icosphere(12e-3, 6);
  const Eigen::VectorXcd exact = solve(mesh, wave(), Scheme::kBurtonMiller, 0.0,
                                       {.kind = SolverKind::kLu, .precision = Precision::kDouble, .tolerance = 1e-12});
  const Eigen::VectorXcd found = solve(mesh, wave(), Scheme::kBurtonMiller, 1e-5,
                                       {.kind = SolverKind::kFft, .tolerance = 1e-9, .max_steps = 1000});
  // The near integrals of systems with a grid are kept in single precision.
  EXPECT_LT((found - exact).norm(), 1e-6 * exact.norm());
}

TEST(GridSolver, TransposedSolvesAreReciprocal) {
  const TriangleMesh mesh = icosphere(12e-3, 6);
  SystemOptions options;
  options.grid_tolerance = 1e-5;
  const ScatteringSystem system(mesh, wave(), Scheme::kBurtonMillerPolished, options);
  const auto solver = make_solver(system, {.kind = SolverKind::kFft});
  const IncidentField unit = system.incident(plane_wave(Vector3::UnitZ(), 1.0));
  const Eigen::VectorXcd p = system.pressure(solver->solve(system.right_hand_side(unit)).x, unit);
  const std::vector<Eigen::Index> faces = {0, 17, 400};
  const Eigen::Index m = system.faces();
  const Eigen::MatrixXcd weights = Eigen::MatrixXcd::Identity(m, m)(Eigen::all, faces);
  const Eigen::MatrixXcd x = solver->solve_transpose(system.transposed_right_hand_side(weights)).x;
  EXPECT_LT((system.weighted_rows(weights, x, unit) - p(faces)).norm(), 1e-3 * p(faces).norm());
}

}  // namespace touchfield::grid_solver_test
