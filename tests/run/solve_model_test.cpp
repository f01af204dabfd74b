#include "sim/run/solve_model.h"

#include "sim/core/progress.h"
#include "tests/support/solve_support.h"
#include "tests/support/testing.h"

namespace touchfield::solve_model_test {

touchfield::Run solved(const Model& model) { return solve_model(model); }

TEST(SolveModel, ShowsTheRunAfterEachMethod) {
  std::vector<std::string> shown;
  Progress progress;
  const touchfield::Run run = solve_model(
      small_model(), {.command_line = "a line"},
      [&](const touchfield::Run& so_far) {
        EXPECT_FALSE(so_far.complete);
        EXPECT_TRUE(so_far.provenance.end.empty());
        EXPECT_GT(so_far.methods.back().metrics.relative_error, 0.0);
        shown.push_back(so_far.methods.back().name);
      },
      progress);
  EXPECT_THAT(shown, ElementsAre("paper", "unscattered", "focus"));
  EXPECT_TRUE(run.complete);
  EXPECT_EQ(run.provenance.command_line, "a line");
  EXPECT_FALSE(run.provenance.end.empty());
}

// As a program does that brings phases of its own.
TEST(SolveModel, PhasesThatAreGivenToTheModelMustFitTheChannels) {
  Model model = small_model({"target=null", "solve.methods=[{fixed: {phases_rad: 0}}]"});
  MethodSpec& given = own_part(model).scene.solve.methods.front();
  given.phases.assign(static_cast<std::size_t>(model.fixed->array.size()), 0.0);
  EXPECT_EQ(solved(model).methods.front().solution.phases.size(), model.fixed->array.size());
  given.phases.pop_back();
  EXPECT_THROW(solved(model), InputError);
}

TEST(SolveModel, BestPressureIsFoundForTheFirstMethod) {
  const touchfield::Run given = solved(small_model({"target.pressure_pa=5000"}));
  const touchfield::Run best = solved(small_model({"target.pressure_pa=best"}));
  EXPECT_LE(best.methods.front().metrics.relative_error, given.methods.front().metrics.relative_error + 1e-3);
  EXPECT_NE(best.target->amplitudes.maxCoeff(), 1.0);
}

TEST(SolveModel, TheBoundIsBelowWhatAnyMethodReaches) {
  const touchfield::Run run =
      solved(small_model({"solve.optimality_bound=true",
                          "solve.methods=[surface, paper, focus, {radiation: {start: {random: 1, restarts: 24}}}]"}));
  for (const MethodResult& method : run.methods) {
    EXPECT_GT(method.metrics.cost_bound, 0.0);
    EXPECT_LE(method.metrics.error_bound, method.metrics.relative_error_raw * (1 + 1e-9)) << method.name;
    EXPECT_GT(method.metrics.error_bound, 0.0);
    EXPECT_LE(method.metrics.cost_bound, method.metrics.cost_skin * (1 + 1e-9)) << method.name;
    EXPECT_EQ(std::isnan(method.metrics.cost_radiation), method.name != "radiation");
  }
  const Metrics& pressed = run.methods.back().metrics;
  EXPECT_NEAR(pressed.cost_radiation, pressed.cost, 1e-4 * pressed.cost);
  EXPECT_GT(pressed.optimality_gap_radiation, 0.0);
  EXPECT_LT(pressed.optimality_gap_radiation, 0.1);
}

/// The message with which solving ends, and how many methods were shown before.
std::pair<std::string, int> ended(const std::vector<std::string>& changes) {
  Progress silent;
  int shown = 0;
  const std::string message = message_of<NumericalError>([&] {
    solve_model(
        small_model(changes), {}, [&](const touchfield::Run&) { ++shown; }, silent);
  });
  return {message, shown};
}

TEST(SolveModel, ASystemThatIsNotSolvedEndsTheRunBeforePhases) {
  const std::vector<std::string> one_step = {"solve.solver=gmres", "solve.max_steps=1", "solve.scheme=paper"};
  for (const std::string methods : {"[paper]", "[unscattered]", "[surface]", "[focus]"}) {
    std::vector<std::string> changes = one_step;
    changes.push_back("solve.methods=" + methods);
    const auto [message, shown] = ended(changes);
    EXPECT_THAT(message, AllOf(HasSubstr("scheme paper by GMRES, stored"), HasSubstr("for a tolerance of 1.0e-04"),
                               HasSubstr("burton_miller_polished")))
        << methods;
    EXPECT_EQ(shown, 0) << methods;
  }
}

}  // namespace touchfield::solve_model_test
