#include "sim/core/progress.h"
#include "sim/run/run_file.h"
#include "sim/run/solve_model.h"
#include "solvers/phase/skin_problem.h"
#include "tests/support/output_support.h"
#include "tests/support/solve_support.h"
#include "tests/support/testing.h"

namespace touchfield::run_transfer_test {

using Eigen::MatrixXcd;
using Eigen::VectorXcd;

/// The run of the small scene, as run.h5 gives it back.
RunData reread(const std::vector<std::string>& changes) {
  Progress progress;
  const TemporaryDirectory directory;
  const RunData run = solve_model(
      small_model(changes), {}, [](const RunData&) {}, progress);
  write_run_file(directory.file("run.h5"), run);
  return read_run_file(directory.file("run.h5"));
}

double relative(const VectorXcd& found, const VectorXcd& expected) {
  return (found - expected).norm() / expected.norm();
}

TEST(RunTransfer, GivesBackTheRunsOwnCostsAndPressures) {
  const RunData run =
      reread({"solve.methods=[surface, lbfgs, paper]", "solve.optimality_bound=true", "write=[transfer]"});
  ASSERT_EQ(run.transfers.size(), 1U);
  const RunTransfer& transfer = run.transfers.front();
  EXPECT_EQ(transfer.scheme, run.methods.front().scheme);
  EXPECT_EQ(transfer.outside_weight, 1.0);
  EXPECT_LT(transfer.channels_left_out, 1e-4);
  for (const MethodResult& method : run.methods) {
    const VectorXcd q = drive(method.solution);
    if (method.name != "paper") {
      const double cost = method.solution.cost_history.back();
      EXPECT_NEAR(skin_cost(transfer.problem, q), cost, 1e-10 * cost) << method.name;
    }
    const double scored = skin_cost(transfer.problem, best_level(transfer.problem, q) * q);
    EXPECT_NEAR(scored, method.metrics.cost_skin, 1e-10 * scored) << method.name;
    EXPECT_LT(relative(transfer.problem.target * q, method.pressure(run.target->faces)), 1e-3) << method.name;
  }
}

// Without a body to scatter it the pressure at a face is the channel's own spherical wave.
TEST(RunTransfer, HoldsTheIncidentPressures) {
  const RunData run = reread({"array.directivity=omni", "write=[transfer]"});
  const RunTransfer& transfer = run.transfers.front();
  const Wave wave = small_model().fixed->wave;
  for (const Eigen::Index n : {0, 27, 63}) {
    for (Eigen::Index j = 0; j < run.target->size(); ++j) {
      const Eigen::Index face = run.target->faces[static_cast<std::size_t>(j)];
      const double distance = (run.mesh.centroids().col(face) - run.array.positions.col(n)).norm();
      const Complex expected = std::polar(run.array.amplitudes(n) / distance, wave.k() * distance);
      EXPECT_LT(std::abs(transfer.incident(j, n) - expected), 1e-9 * std::abs(expected));
    }
  }
  EXPECT_GT((transfer.incident - transfer.problem.target).norm(), 0.1 * transfer.incident.norm());
}

TEST(RunTransfer, IsOfTheScenesSchemeAndOfThoseOfMethodsOnTheSkin) {
  const RunData run = reread({"solve.methods=[paper, {gs: {scheme: paper_corrected}}, {focus: {scheme: paper}}]",
                              "solve.outside_weight=0", "write=[transfer]"});
  std::vector<std::string> schemes;
  for (const RunTransfer& transfer : run.transfers) {
    schemes.push_back(transfer.scheme);
    EXPECT_EQ(transfer.problem.outside.rows(), 0);
    EXPECT_EQ(transfer.problem.target_count(), run.target->size());
  }
  EXPECT_THAT(schemes, UnorderedElementsAre(run.methods.front().scheme, "paper_corrected"));
}

}  // namespace touchfield::run_transfer_test
