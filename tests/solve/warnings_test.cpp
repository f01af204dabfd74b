#include "sim/solve/warnings.h"

#include <gmock/gmock.h>

#include "sim/core/progress.h"
#include "sim/solve/solve_model.h"
#include "tests/support/solve_support.h"

namespace touchfield {
namespace {

using support::small_model;
using testing::Contains;
using testing::IsEmpty;
using testing::Not;
using testing::StartsWith;

touchfield::Run unsolved(const Model& model) {
  Progress progress;
  return solve_model(
      model, {}, [](const touchfield::Run&) {}, progress);
}

TEST(ModelWarnings, ASoundSceneHasNone) { EXPECT_THAT(model_warnings(small_model()), IsEmpty()); }

TEST(ModelWarnings, EachIsNamed) {
  EXPECT_THAT(model_warnings(small_model({"body.edge_mm=3.8"})), Contains(StartsWith("coarse_mesh: ")));
  EXPECT_THAT(model_warnings(small_model({"array.rotate_deg=[180, 0, 0]"})), Contains(StartsWith("behind_array: ")));
  EXPECT_THAT(model_warnings(small_model({"body.place.at_mm=[5.08, 5.08, 1.5]"})),
              Contains(StartsWith("near_source: ")));
  EXPECT_THAT(model_warnings(small_model({"body={box: {size_mm: [20, 20, 3]}, edge_mm: 2.5, "
                                          "place: {landmark: bottom, at_mm: [0, 0, 50]}}"})),
              Contains(StartsWith("thin_body: ")));
}

TEST(ResultWarnings, ASolveThatMissedItsToleranceIsNamed) {
  touchfield::Run run = unsolved(small_model());
  EXPECT_THAT(result_warnings(run, Scheme::kBurtonMiller), IsEmpty());
  run.solves.front().converged = false;
  EXPECT_THAT(result_warnings(run, Scheme::kBurtonMiller),
              Contains(StartsWith("not_converged: " + run.solves.front().stage + ": ")));
  run.solves.front().stage = "alarm";  // which has a warning of its own
  EXPECT_THAT(result_warnings(run, Scheme::kBurtonMiller), IsEmpty());
}

TEST(ResultWarnings, TheAlarmIsOfSchemesWithoutACure) {
  touchfield::Run run = unsolved(small_model());
  run.alarm = 0.11;
  EXPECT_THAT(result_warnings(run, Scheme::kPaper), Contains(StartsWith("fictitious_frequency: ")));
  EXPECT_THAT(result_warnings(run, Scheme::kBurtonMiller), IsEmpty());
  run.alarm = 0.09;
  EXPECT_THAT(result_warnings(run, Scheme::kPaper), IsEmpty());
}

TEST(ResultWarnings, AQuietTargetIsInTheShadow) {
  touchfield::Run run = unsolved(small_model());
  for (const Eigen::Index f : run.target->faces) {
    run.methods.front().pressure(f) *= 0.01;
  }
  EXPECT_THAT(result_warnings(run, Scheme::kBurtonMiller), Contains(StartsWith("deep_shadow: ")));
}

}  // namespace
}  // namespace touchfield
