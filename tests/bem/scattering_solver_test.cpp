#include "sim/bem/scattering_solver.h"

#include <cmath>
#include <limits>
#include <memory>
#include <string>
#include <tuple>
#include <vector>

#include "sim/hand/shapes.h"
#include "solvers/linear/factorisations.h"
#include "tests/support/linear_support.h"
#include "tests/support/sphere_support.h"
#include "tests/support/testing.h"

namespace touchfield::scattering_solver_test {

const ScatteringSystem& system_of(Scheme scheme) {
  static const std::vector<std::unique_ptr<ScatteringSystem>> systems = [] {
    std::vector<std::unique_ptr<ScatteringSystem>> all;
    for (const Scheme s : all_schemes()) {
      all.push_back(std::make_unique<ScatteringSystem>(icosphere(7e-3, 4), wave(), s));  // ka 5.13, 320 faces
    }
    return all;
  }();
  return *systems[static_cast<std::size_t>(scheme)];
}

/// Two right-hand sides of very different size.
Eigen::MatrixXcd right_hand_sides(const ScatteringSystem& system) {
  std::srand(1);
  Eigen::MatrixXcd b = Eigen::MatrixXcd::Random(system.faces(), 2);
  b.col(1) *= 1e-6;
  return b;
}

using Case = std::tuple<Scheme, SolverKind, Precision>;

class EverySolver : public ::testing::TestWithParam<Case> {
 protected:
  const ScatteringSystem& system_ = system_of(std::get<0>(GetParam()));
  SolverOptions options_{.kind = std::get<1>(GetParam()), .precision = std::get<2>(GetParam())};
};

std::string name_of(const ::testing::TestParamInfo<Case>& info) {
  const SolverKind kind = std::get<1>(info.param);
  return to_string(std::get<0>(info.param)) +
         (kind == SolverKind::kLu      ? "_lu_"
          : kind == SolverKind::kGmres ? "_gmres_"
                                       : "_matrix_free_") +
         to_string(std::get<2>(info.param));
}

INSTANTIATE_TEST_SUITE_P(ScatteringSolver, EverySolver,
                         ::testing::Combine(::testing::ValuesIn(all_schemes()),
                                            ::testing::Values(SolverKind::kLu, SolverKind::kGmres,
                                                              SolverKind::kMatrixFree),
                                            ::testing::Values(Precision::kSingle, Precision::kDouble)),
                         name_of);

TEST_P(EverySolver, AgreesWithLuInDouble) {
  options_.tolerance = 1e-10;  // in single precision only by refinement
  options_.max_steps = 1500;
  options_.restart = 400;
  const auto solver = make_solver(system_, options_);
  const DenseLu lu(system_.dense());
  const Eigen::MatrixXcd b = right_hand_sides(system_);
  const double tolerance = 1e-10 / lu.reciprocal_condition();  // what a residual of 1e-10 leaves of the solution
  const Solved solved = solver->solve(b);
  EXPECT_TRUE(solved.report.converged);
  EXPECT_LE(solved.report.residual, 1e-10);
  EXPECT_NEAR(worst_residual(system_.dense() * solved.x, b), solved.report.residual, 2e-12);  // it is the true one
  EXPECT_LT(worst_residual(solved.x, lu.solve(b)), tolerance);
  const Solved transposed = solver->solve_transpose(b);
  EXPECT_TRUE(transposed.report.converged);
  EXPECT_NEAR(worst_residual(system_.dense().transpose() * transposed.x, b), transposed.report.residual, 2e-12);
  EXPECT_LT(worst_residual(transposed.x, lu.solve_transpose(b)), tolerance);
  if (options_.kind == SolverKind::kLu) {
    EXPECT_EQ(solved.report.steps, 0);
    EXPECT_NEAR(std::log10(solver->reciprocal_condition() / lu.reciprocal_condition()), 0.0, 0.3);
  } else {
    EXPECT_GT(solved.report.steps, 5);
    EXPECT_TRUE(std::isnan(solver->reciprocal_condition()));
  }
  EXPECT_EQ(solved.report.refinements > 0, options_.precision == Precision::kSingle);
}

TEST(ScatteringSolver, TooFewStepsAreReported) {
  for (const SolverKind kind : {SolverKind::kGmres, SolverKind::kMatrixFree}) {
    for (const Precision precision : {Precision::kSingle, Precision::kDouble}) {
      SolverOptions options{.kind = kind, .precision = precision, .tolerance = 1e-5};
      options.max_steps = 2;
      const ScatteringSystem& system = system_of(Scheme::kBurtonMiller);
      const Eigen::MatrixXcd b = right_hand_sides(system);
      const Solved solved = make_solver(system, options)->solve(b);
      EXPECT_FALSE(solved.report.converged);
      EXPECT_LE(solved.report.steps, 2);
      EXPECT_GT(solved.report.residual, 1e-5);
      EXPECT_LT(solved.report.residual, 1.0);
      EXPECT_NEAR(worst_residual(system.exact().apply(solved.x), b), solved.report.residual, 1e-9);
    }
  }
}

TEST(ScatteringSolver, ARoughSolutionTellsItsResidualBySingleProducts) {
  // From a tolerance of 1e-4 on no product in double is made: the residual told is the one in single precision plus
  // that precision's 3e-6, so that the true one is never above it.
  const ScatteringSystem& system = system_of(Scheme::kBurtonMiller);
  const Eigen::MatrixXcd b = right_hand_sides(system);
  const Solved solved = make_solver(system, {})->solve(b);
  const double residual = worst_residual(system.exact().apply(solved.x), b);
  EXPECT_TRUE(solved.report.converged);
  EXPECT_LE(residual, solved.report.residual);
  EXPECT_GT(residual, solved.report.residual - 6e-6);
}

TEST(ScatteringSolver, AValueThatIsNotFiniteNamesTheSystem) {
  const ScatteringSystem& system = system_of(Scheme::kPaper);
  Eigen::MatrixXcd b = right_hand_sides(system);
  b(3, 1) = std::numeric_limits<double>::quiet_NaN();
  const auto solver = make_solver(system, {});
  EXPECT_THAT(message_of<NumericalError>([&] { solver->solve(b); }),
              HasSubstr("320 faces, scheme paper, GMRES, matrix-free in single precision"));
}

TransducerArray channels(double height) {
  Points at(3, 5);
  at << 0.01, -0.03, 0.002, 0.05, -0.01,  //
      0.02, 0.0, 0.01, -0.04, 0.03,       //
      0.15, 0.12, -0.1, 0.02, 0.2;
  at.row(2).array() += height;
  return omni_at(at);
}

class FactoredTransferOf : public ::testing::TestWithParam<Scheme> {};

INSTANTIATE_TEST_SUITE_P(EveryScheme, FactoredTransferOf, ::testing::ValuesIn(all_schemes()),
                         [](const auto& info) { return to_string(info.param); });

// Single precision: k r of 150 is known to 1e-5, times what a condition below 100 makes of it.
TEST_P(FactoredTransferOf, MultipliesByTheTransferMatrixOfTheDoubleSolver) {
  const ScatteringSystem system(icosphere(7e-3, 3), wave(), GetParam());
  const DenseLu lu(system.dense());
  FactoredTransfer factored(system);
  for (const double height : {0.0, 0.03}) {  // the array moves, the factors stay
    const TransducerArray array = channels(height);
    const IncidentField unit = system.incident(array);
    const Eigen::MatrixXcd h = system.pressure(lu.solve(system.right_hand_side(unit)), unit);
    factored.face(system, array);
    std::srand(3);
    const Eigen::VectorXcd q = Eigen::VectorXcd::Random(array.size());
    const Eigen::VectorXcd v = Eigen::VectorXcd::Random(system.faces());
    const Eigen::VectorXcd p = h * q;
    const Eigen::VectorXcd back = h.adjoint() * v;
    EXPECT_LT((factored.pressure(q.cast<std::complex<float>>()).cast<Complex>() - p).norm(), 1e-4 * p.norm());
    EXPECT_LT((factored.sent_back(v.cast<std::complex<float>>()).cast<Complex>() - back).norm(), 1e-4 * back.norm());
  }
}

}  // namespace touchfield::scattering_solver_test
