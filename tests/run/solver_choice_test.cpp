#include "sim/run/solver_choice.h"

#include "sim/gpu/gpu_library.h"
#include "tests/support/solve_support.h"
#include "tests/support/testing.h"

namespace touchfield::solver_choice_test {

constexpr double kGibibyte = 1024.0 * 1024.0 * 1024.0;

SolverOptions chosen(Scheme scheme, Eigen::Index unknowns, Eigen::Index right_hand_sides = 1, double gibibytes = 16) {
  return choose_solver({}, scheme, unknowns, gibibytes * kGibibyte, right_hand_sides).options;
}

TEST(SolverChoice, BurtonMillerIsNotStoredUnlessManyRightHandSidesShareAFactorisation) {
  for (const Scheme scheme : {Scheme::kBurtonMiller, Scheme::kBurtonMillerPolished}) {
    EXPECT_EQ(chosen(scheme, 6000).kind, SolverKind::kMatrixFree);
    EXPECT_EQ(chosen(scheme, 6000, 11).kind, SolverKind::kMatrixFree);
    EXPECT_EQ(chosen(scheme, 6000, 12).kind, SolverKind::kLu);
  }
}

TEST(SolverChoice, AMatrixTakesAtMostHalfOfTheFreeMemory) {
  // 20,000 unknowns in single are 2.98 GiB.
  EXPECT_EQ(chosen(Scheme::kPaper, 20000, 1, 6.0).kind, SolverKind::kLu);
  EXPECT_EQ(chosen(Scheme::kPaper, 20000, 1, 5.9).kind, SolverKind::kMatrixFree);
  EXPECT_EQ(chosen(Scheme::kBurtonMiller, 20000, 400, 6.0).kind, SolverKind::kLu);
  EXPECT_EQ(chosen(Scheme::kBurtonMiller, 20000, 400, 5.9).kind, SolverKind::kMatrixFree);
  // Where the system does not say how much is free, nothing is refused.
  EXPECT_EQ(chosen(Scheme::kPaper, 20000, 1, 0.0).kind, SolverKind::kLu);
}

TEST(SolverChoice, ProductsGoThroughAGridWhereThatIsFaster) {
  const auto kind = [](Eigen::Index unknowns, Eigen::Index columns, double by_grid, const SolverSpec& spec = {},
                       Scheme scheme = Scheme::kBurtonMillerPolished) {
    const BodyCost cost{.grid = {.seconds = by_grid}};
    return choose_solver(spec, scheme, unknowns, 100.0 * kGibibyte, columns, cost).options.kind;
  };
  const double direct = direct_seconds(50000, 1);
  EXPECT_EQ(kind(50000, 1, 0.1 * direct), SolverKind::kFft);
  EXPECT_EQ(kind(50000, 1, 0.9 * direct), SolverKind::kMatrixFree);   // the grid must be made first
  EXPECT_EQ(kind(50000, 12, 0.4 * direct), SolverKind::kMatrixFree);  // columns share the kernels of direct products
  EXPECT_EQ(kind(50000, 400, direct), SolverKind::kLu);
  EXPECT_EQ(kind(50000, 400, 0.01 * direct), SolverKind::kFft);  // 400 cheap columns take less than factorising
  // Finer than grids are: few products are taken pair by pair, to refine, or all.
  EXPECT_EQ(kind(50000, 1, 0.1 * direct, {.tolerance = 1e-9}), SolverKind::kFft);
  EXPECT_EQ(kind(50000, 1, 0.1 * direct, {.tolerance = 1e-9, .refine = false}), SolverKind::kMatrixFree);
  EXPECT_EQ(kind(50000, 1, 0.1 * direct, {.precision = PrecisionChoice::kSingle, .tolerance = 1e-6}),
            SolverKind::kMatrixFree);  // finer than single precision
  EXPECT_EQ(kind(500, 1, 1.0, {.solver = SolverChoice::kFft}), SolverKind::kFft);
  EXPECT_EQ(kind(50000, 1, 0.1 * direct, {}, Scheme::kChief), SolverKind::kLu);
  const SolverSpec fine{.solver = SolverChoice::kFft, .tolerance = 1e-5};
  EXPECT_EQ(choose_device(fine, Scheme::kBurtonMiller, 100000, 1).card, std::nullopt);
  EXPECT_EQ(sums_on_card(fine, 100000), SolverKind::kMatrixFree);
  EXPECT_EQ(sums_on_card({.solver = SolverChoice::kFft}, 500), SolverKind::kFft);
  EXPECT_EQ(sums_on_card({}, 5000), SolverKind::kMatrixFree);
  EXPECT_EQ(sums_on_card({}, 50000), SolverKind::kFft);
}

TEST(SolverChoice, PrecisionAndToleranceDecideWhatAGridIsMadeIn) {
  EXPECT_DOUBLE_EQ(grid_tolerance({.tolerance = 1e-4}), 1e-5);
  EXPECT_DOUBLE_EQ(grid_tolerance({.tolerance = 1e-9}), kFinestGridTolerance);
  EXPECT_GE(grid_tolerance({.precision = PrecisionChoice::kSingle, .tolerance = 1e-9}), kFinestSingleGrid);
  EXPECT_LT(grid_tolerance({.precision = PrecisionChoice::kDouble, .tolerance = 1e-2}), kFinestSingleGrid);
  const auto precision = [](const SolverSpec& spec) {
    return choose_solver(spec, Scheme::kBurtonMiller, 100000, 0.0, 1, {.grid = {.seconds = 1e-3}}).options.precision;
  };
  EXPECT_EQ(precision({.solver = SolverChoice::kFft}), Precision::kSingle);
  EXPECT_EQ(precision({.solver = SolverChoice::kFft, .tolerance = 1e-5}), Precision::kDouble);
  EXPECT_EQ(precision({.solver = SolverChoice::kFft, .precision = PrecisionChoice::kDouble}), Precision::kDouble);
}

TEST(SolverChoice, ChiefHasNoIteration) { EXPECT_EQ(chosen(Scheme::kChief, 20000, 1, 0.1).kind, SolverKind::kLu); }

TEST(SolverChoice, TheSceneIsObeyed) {
  const SolverSpec spec{.solver = SolverChoice::kGmres,
                        .precision = PrecisionChoice::kSingle,
                        .tolerance = 1e-3,
                        .refine = false,
                        .max_steps = 17};
  const SolverDecision decision = choose_solver(spec, Scheme::kChief, 100, 0.0, 1000);
  EXPECT_EQ(decision.options.kind, SolverKind::kGmres);
  EXPECT_EQ(precision_name(decision.options), "single");
  EXPECT_EQ(decision.options.tolerance, 1e-3);
  EXPECT_EQ(decision.options.max_steps, 17);
  EXPECT_EQ(decision.reason, "as the scene asks");
}

TEST(DeviceChoice, TheProcessorDoesWhatOnlyItKnows) {
  constexpr Eigen::Index kMany = 20'000;
  SolverSpec spec;
  EXPECT_FALSE(choose_device(spec, Scheme::kChief, kMany, 400).card);
  EXPECT_FALSE(choose_device(spec, Scheme::kPaper, 1000, 100).card);  // a card would hardly have started
  EXPECT_EQ(choose_device(spec, Scheme::kPaper, kMany, 400).card.has_value(), gpu_library().cards > 0);
  spec.tolerance = 1e-6;
  EXPECT_FALSE(choose_device(spec, Scheme::kPaper, kMany, 400).card);
  spec.tolerance = 1e-4;
  spec.precision = PrecisionChoice::kDouble;
  EXPECT_FALSE(choose_device(spec, Scheme::kPaper, kMany, 400).card);
  spec.precision = PrecisionChoice::kAuto;
  spec.device = *compute_device("cpu");
  EXPECT_FALSE(choose_device(spec, Scheme::kPaper, kMany, 400).card);
}

TEST(DeviceChoice, ACardThatIsAskedForIsThereOrAnError) {
  SolverSpec spec{.device = *compute_device("cuda:" + std::to_string(gpu_library().cards))};
  EXPECT_THROW(choose_device(spec, Scheme::kPaper, 100, 1), NotBuiltError);
  if (gpu_library().cards > 0) {
    spec.device = *compute_device("cuda");
    EXPECT_EQ(choose_device(spec, Scheme::kPaper, 100, 1).card, 0);
    EXPECT_FALSE(choose_device(spec, Scheme::kChief, 100, 1).card);
    spec.tolerance = 1e-6;
    EXPECT_FALSE(choose_device(spec, Scheme::kPaper, 100, 1).card);
  }
}

TEST(DeviceChoice, TextIsReadAndWritten) {
  for (const char* text : {"auto", "cpu", "cuda", "cuda:1", "cuda:12"}) {
    ASSERT_TRUE(compute_device(text)) << text;
    EXPECT_EQ(to_string(*compute_device(text)), text);
  }
  EXPECT_EQ(compute_device("cuda:0"), compute_device("cuda"));
  for (const char* text : {"", "gpu", "cuda:", "cuda:-1", "cuda:1x", "cuda1", "CUDA", "cuda:99999999999"}) {
    EXPECT_FALSE(compute_device(text)) << text;
  }
}

}  // namespace touchfield::solver_choice_test
