// Channels that are not as designed: what the solver knows of them, and what the evaluation uses.

#include <numbers>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gtest/gtest.h>

#include "sim/run/evaluate_methods.h"
#include "sim/run/solve_model.h"
#include "tests/support/solve_support.h"

namespace touchfield::array_truth_test {

using RunData = touchfield::Run;

constexpr int kChannels = 64;
constexpr const char* kEveryMethod =
    "solve.methods=[surface, paper, {paper: {as: original, scheme: paper}}, unscattered, focus, gs, wgs, gs_pat, "
    "eigen, "
    "lbfgs, {surface: {as: free, free_amplitudes: true}}, {surface: {as: random, start: {random: 3}}}, "
    "{surface: {as: spectral, start: spectral}}, {surface: {as: adjoint, start: adjoint}}]";

RunData solved(const std::vector<std::string>& changes) { return solve_model(small_model(changes)); }

std::string calibration(const Eigen::VectorXd& gain, const Eigen::VectorXd& phase, const std::string& in) {
  return fmt::format("array.calibration={{gain: [{:.17g}], phase_rad: [{:.17g}], in: {}}}",
                     fmt::join(gain.begin(), gain.end(), ", "), fmt::join(phase.begin(), phase.end(), ", "), in);
}

std::string calibration(double gain, double phase, const std::string& in) {
  return calibration(Eigen::VectorXd::Constant(kChannels, gain), Eigen::VectorXd::Constant(kChannels, phase), in);
}

double apart(const Eigen::VectorXcd& a, const Eigen::VectorXcd& b) { return (a - b).norm() / b.norm(); }

TEST(ArrayTruth, ThatTheSolverDoesNotKnowIsTheEvaluationsAlone) {
  const RunData ideal = solved({});
  const RunData weak = solved({calibration(0.5, 0.4, "truth")});
  EXPECT_EQ(ideal.evaluation, "same");
  EXPECT_EQ(weak.evaluation, "truth");
  ASSERT_TRUE(weak.array_truth.has_value());
  EXPECT_TRUE(weak.array.response.as_designed());
  EXPECT_EQ(weak.array_truth->response.gain(7), 0.5);
  for (std::size_t s = 0; s < ideal.methods.size(); ++s) {
    EXPECT_EQ(weak.methods[s].solution.phases, ideal.methods[s].solution.phases);
    EXPECT_EQ(weak.methods[s].pressure, ideal.methods[s].pressure);
    EXPECT_LT(apart(weak.methods[s].evaluation_pressure, std::polar(0.5, 0.4) * ideal.methods[s].pressure), 1e-4);
    EXPECT_NEAR(weak.methods[s].metrics.relative_error, ideal.methods[s].metrics.relative_error, 1e-4);
    EXPECT_NEAR(weak.methods[s].metrics.mean_inside_pa, 0.5 * ideal.methods[s].metrics.mean_inside_pa,
                1e-4 * ideal.methods[s].metrics.mean_inside_pa);
  }
}

// A known phase is made up for by the drive; a wrongly assumed one spoils what sounds by as much.
TEST(ArrayTruth, AKnownPhaseIsMadeUpForAndAWrongOneIsHeard) {
  Eigen::VectorXd phase(kChannels);
  for (Eigen::Index n = 0; n < kChannels; ++n) phase(n) = 2.0 * std::sin(5.0 * static_cast<double>(n));
  const std::vector<std::string> base = {"solve.methods=[focus, eigen]"};
  const auto with = [&](const std::string& in) {
    return solved({base.front(), calibration(Eigen::VectorXd::Ones(kChannels), phase, in)});
  };
  const RunData ideal = solved(base);
  const RunData known = with("both");
  const RunData unknown = with("truth");
  const RunData mistaken = with("solver");
  for (std::size_t s = 0; s < ideal.methods.size(); ++s) {
    const double error = ideal.methods[s].metrics.relative_error;
    EXPECT_NEAR(known.methods[s].metrics.relative_error, error, 1e-3);
    EXPECT_GT(apart(unknown.methods[s].evaluation_pressure, ideal.methods[s].pressure), 0.3);
    EXPECT_GT(apart(mistaken.methods[s].evaluation_pressure, ideal.methods[s].pressure), 0.3);
    EXPECT_LT(apart(mistaken.methods[s].pressure, ideal.methods[s].pressure), 1e-3);  // as it believes
    const Eigen::ArrayXd turned =
        known.methods[s].solution.phases.array() + phase.array() - ideal.methods[s].solution.phases.array();
    EXPECT_LT((turned.sin().square() + (turned.cos() - 1).square()).maxCoeff(), 1e-4);
  }
}

// Every method does with dead channels what it does without them, and leaves them silent.
TEST(ArrayTruth, EveryMethodLeavesDeadChannelsOut) {
  Eigen::VectorXd gain = Eigen::VectorXd::Ones(kChannels);
  for (const Eigen::Index n : {0, 9, 27, 28, 40, 63}) gain(n) = 0.0;
  const std::string pressure = "target.pressure_pa=600";
  const RunData dead = solved({kEveryMethod, pressure, "solve.optimality_bound=true", "solve.iterations=15",
                               calibration(gain, Eigen::VectorXd::Zero(kChannels), "both")});
  std::string positions;
  for (Eigen::Index n = 0; n < kChannels; ++n) {
    if (gain(n) > 0) {
      const Vector3 mm = 1e3 * dead.array.positions.col(n);
      positions += fmt::format("{}[{:.17g}, {:.17g}, {:.17g}]", positions.empty() ? "" : ", ", mm.x(), mm.y(), mm.z());
    }
  }
  const RunData fewer = solved({kEveryMethod, pressure, "solve.optimality_bound=true", "solve.iterations=15",
                                fmt::format("array={{positions: {{points_mm: [{}]}}}}", positions)});
  ASSERT_EQ(dead.methods.size(), 14U);
  for (std::size_t s = 0; s < dead.methods.size(); ++s) {
    const MethodResult& method = dead.methods[s];
    SCOPED_TRACE(method.name);
    ASSERT_TRUE(method.solution.phases.allFinite());
    for (Eigen::Index n = 0; n < kChannels; ++n) {
      if (gain(n) == 0) {
        EXPECT_EQ(method.solution.phases(n), 0.0);
        EXPECT_EQ(method.solution.amplitudes(n), 0.0);
      } else {
        EXPECT_GT(method.solution.amplitudes(n), 0.0);
      }
    }
    if (method.name != "random") {  // which starts elsewhere
      EXPECT_NEAR(method.metrics.relative_error, fewer.methods[s].metrics.relative_error, 1e-2);
    }
    EXPECT_NEAR(method.metrics.cost_bound, fewer.methods[s].metrics.cost_bound,
                0.01 * fewer.methods[s].metrics.cost_bound);
    EXPECT_LE(method.metrics.cost_bound, method.metrics.cost_skin);
  }
}

TEST(ArrayTruth, EveryMethodCopesWithAnArrayThatIsAllDead) {
  const RunData dead = solved({kEveryMethod, "target.pressure_pa=600", calibration(0.0, 0.0, "both")});
  for (const MethodResult& method : dead.methods) {
    EXPECT_EQ(method.solution.phases, Eigen::VectorXd::Zero(kChannels)) << method.name;
    EXPECT_EQ(method.pressure.norm(), 0.0) << method.name;
  }
}

TEST(ArrayTruth, RoundedPhasesAreThoseThatSound) {
  const std::vector<std::string> methods = {"solve.methods=[focus, surface]"};
  const RunData exact = solved(methods);
  const RunData rounded = solved({methods.front(), "array.phase_levels=4"});
  EXPECT_EQ(rounded.methods.front().solution.phases, exact.methods.front().solution.phases);
  for (const MethodResult& method : rounded.methods) {
    Eigen::VectorXd steps = (method.solution.phases.array() * 2 / std::numbers::pi).round() * std::numbers::pi / 2;
    const RunData given = solved({fmt::format("solve.methods=[{{fixed: {{phases_rad: [{:.17g}]}}}}]",
                                              fmt::join(steps.begin(), steps.end(), ", "))});
    EXPECT_LT(apart(method.evaluation_pressure, given.methods.front().pressure), 1e-4);
    EXPECT_GT(apart(method.evaluation_pressure, method.pressure), 0.05);
  }
  const RunData fine = solved({methods.front(), "array.phase_levels=4096"});
  EXPECT_LT(apart(fine.methods.front().evaluation_pressure, fine.methods.front().pressure), 2e-3);
}

}  // namespace touchfield::array_truth_test
