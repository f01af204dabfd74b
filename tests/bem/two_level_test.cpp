// The two-level preconditioner and products by a grid: solutions with them against LU and direct products.
#include "sim/bem/two_level.h"

#include <cmath>
#include <vector>

#include "sim/bem/scattering_solver.h"
#include "sim/hand/hand.h"
#include "sim/hand/shapes.h"
#include "tests/support/linear_support.h"
#include "tests/support/testing.h"

namespace touchfield::two_level_test {

Wave wave(double absorption = 0.0) {
  Medium medium = air(293.15);
  medium.absorption = absorption;
  return {medium, 40e3};
}

TriangleMesh folded_hand(double edge) {
  HandOptions options;
  options.edge = edge;
  return hand(options).mesh;
}

SystemOptions by_grid(double tolerance) {
  SystemOptions options;
  options.grid_tolerance = tolerance;
  return options;
}

TEST(CoarseSpace, ProjectionUndoesInterpolationAndKeepsWaves) {
  const TriangleMesh mesh = icosphere(30e-3, 20);
  const CoarseSpace space(mesh, wave().k());
  const Eigen::MatrixXcd c = random_matrix(space.size(), 3, 1);
  EXPECT_LT((space.projected(space.interpolated(c)) - c).norm(), 1e-5 * c.norm());
  Eigen::VectorXcd plane(mesh.face_count());
  for (Eigen::Index f = 0; f < mesh.face_count(); ++f) {
    plane(f) = std::polar(1.0, wave().k() * mesh.centroids()(2, f));
  }
  const double lost = (space.interpolated(space.projected(plane)) - plane).norm() / plane.norm();
  EXPECT_LT(lost, 0.2);
  const Eigen::MatrixXcd v = random_matrix(mesh.face_count(), 1, 1);
  EXPECT_NEAR(std::abs(c.col(0).cwiseProduct(space.projected(v)).sum() -
                       v.cwiseProduct(space.projected_transpose(c.col(0))).sum()),
              0.0, 1e-9 * c.norm() * v.norm());
}

// On a sphere the surface's waves are known: l (l + 1) / R^2 is the Laplacian of harmonics of order l.
TEST(SurfaceFilter, IsItsFunctionOfTheLaplacian) {
  constexpr double kRadius = 20e-3;
  const TriangleMesh mesh = icosphere(kRadius, 40);
  const Complex k = wave(3.0).wavenumber();
  for (const double coupling : {0.5, 1.0, 2.0}) {
    const SurfaceFilter filter(mesh, k, coupling);
    const auto f = [&](double l) {
      const Complex effective = k * Complex(1.0, 0.1);
      return 2.0 / (1.0 + coupling * std::sqrt(1.0 - l / (effective * effective)));
    };
    const Eigen::MatrixXcd still = filter.apply(Eigen::MatrixXcd::Ones(mesh.face_count(), 1));
    EXPECT_LT((still.array() - still(0, 0)).matrix().norm(), 1e-9 * still.norm());
    constexpr unsigned kOrder = 45;  // waves a third as long as those of sound
    Eigen::MatrixXcd harmonic(mesh.face_count(), 1);
    for (Eigen::Index face = 0; face < mesh.face_count(); ++face) {
      harmonic(face, 0) = std::legendre(kOrder, mesh.centroids()(2, face) / mesh.centroids().col(face).norm());
    }
    const Complex exact = f(kOrder * (kOrder + 1) / (kRadius * kRadius));
    // The two-point Laplacian is not consistent on irregular triangles.
    EXPECT_LT((filter.apply(harmonic) - exact * harmonic).norm(), 0.35 * std::abs(exact) * harmonic.norm());
    const Eigen::MatrixXcd x = random_matrix(mesh.face_count(), 2, 1);
    EXPECT_NEAR(std::abs(x.col(0).cwiseProduct(filter.apply(x).col(1)).sum() -
                         x.col(1).cwiseProduct(filter.apply_transpose(x).col(0)).sum()),
                0.0, 1e-10 * x.squaredNorm());
  }
}

struct Case {
  SolverKind kind;
  Precision precision;
  double absorption;
  Scheme scheme;
};

// A folded hand takes 49 steps without.
TEST(TwoLevel, SolutionsAreThoseOfLuInAFewSteps) {
  const TriangleMesh mesh = folded_hand(7e-3);
  constexpr double kTolerance = 1e-4;
  for (const Case& c : std::vector<Case>{{SolverKind::kMatrixFree, Precision::kSingle, 0.0, Scheme::kBurtonMiller},
                                         {SolverKind::kGmres, Precision::kDouble, 5.0, Scheme::kBurtonMillerPolished},
                                         {SolverKind::kFft, Precision::kSingle, 5.0, Scheme::kBurtonMiller}}) {
    const double grid = c.kind == SolverKind::kFft ? 0.1 * kTolerance : 0.0;
    const ScatteringSystem system(mesh, wave(c.absorption), c.scheme, by_grid(grid));
    Eigen::MatrixXcd b = random_matrix(system.faces(), 2, 1);
    b.col(0) = system.right_hand_side(system.incident(plane_wave(Vector3::UnitZ(), 1.0)));
    const SolverOptions options{.kind = c.kind, .precision = c.precision, .tolerance = kTolerance, .two_level = true};
    const DenseLu lu(system.dense());
    const auto solver = make_solver(system, options);
    for (const bool transposed : {false, true}) {
      const Solved solved = transposed ? solver->solve_transpose(b) : solver->solve(b);
      const Eigen::MatrixXcd exact = transposed ? lu.solve_transpose(b) : lu.solve(b);
      EXPECT_TRUE(solved.report.converged);
      EXPECT_TRUE(solved.report.two_level);
      EXPECT_EQ(solved.report.set_aside, "");
      EXPECT_LE(solved.report.steps, 12) << to_string(c.kind);
      for (Eigen::Index s = 0; s < b.cols(); ++s) {
        EXPECT_LT((solved.x.col(s) - exact.col(s)).norm(), 6.0 * kTolerance * exact.col(s).norm()) << to_string(c.kind);
      }
    }
  }
}

// A body of more points than are factorised as a whole: 0.07 m2.
TEST(TwoLevel, LargeBodiesAreSolvedByBlocks) {
  const ScatteringSystem system(icosphere(75e-3, 28), wave(), Scheme::kBurtonMiller, by_grid(1e-5));
  const auto m = system.two_level();
  EXPECT_GT(m->blocks(), 1);
  const Eigen::MatrixXcd x = random_matrix(system.faces(), 2, 1);
  EXPECT_LT(std::abs(x.col(0).cwiseProduct(m->apply(x).col(1)).sum() -
                     x.col(1).cwiseProduct(m->apply_transpose(x).col(0)).sum()),
            1e-5 * m->apply(x).norm() * x.norm());
  const Eigen::MatrixXcd b = system.right_hand_side(system.incident(plane_wave(Vector3::UnitZ(), 1.0)));
  const Solved with = make_solver(system, {.kind = SolverKind::kFft, .two_level = true})->solve(b);
  const Solved without = make_solver(system, {.kind = SolverKind::kFft})->solve(b);
  EXPECT_LE(with.report.steps, 12);
  EXPECT_GT(without.report.steps, with.report.steps);
  EXPECT_LT((with.x - without.x).norm(), 3e-4 * without.x.norm());
}

TEST(TwoLevel, WhatDoesNotServeIsSetAsideAndTheReportSaysWhy) {
  const ScatteringSystem system(icosphere(10e-3, 6), wave(), Scheme::kBurtonMiller);
  const Eigen::MatrixXcd b = random_matrix(system.faces(), 1, 1);
  SolverOptions options{.kind = SolverKind::kGmres, .precision = Precision::kDouble, .refine = false};
  options.tolerance = 1e-17;  // no solution in double reaches it
  options.two_level = true;
  const auto solver = make_solver(system, options);
  for (int round = 0; round < 2; ++round) {  // the second begins without
    const Solved solved = solver->solve(b);
    EXPECT_FALSE(solved.report.two_level);
    EXPECT_THAT(solved.report.set_aside, ::testing::HasSubstr("after 40 steps"));
    EXPECT_LT(solved.report.residual, 1e-13);
  }
}

Eigen::VectorXcd solve(const TriangleMesh& mesh, const Wave& wave, Scheme scheme, double grid_tolerance,
                       const SolverOptions& options) {
  const ScatteringSystem system(mesh, wave, scheme, by_grid(grid_tolerance));
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

}  // namespace touchfield::two_level_test
