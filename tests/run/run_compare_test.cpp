#include "sim/run/run_compare.h"

#include <numbers>

#include "tests/support/output_support.h"
#include "tests/support/testing.h"

namespace touchfield::run_compare_test {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kRoundingOfSums = 1e-14;  // of some ten terms of size 1, with room

RunDifference compared(const RunData& a, const RunData& b) { return compare_runs(a, b, {}); }

/// full_run after a change against full_run as it is.
RunDifference changed(const std::function<void(RunData&)>& change) {
  RunData run = full_run();
  change(run);
  return compared(full_run(), run);
}

TEST(NumbersDifference, IsTheLargestOverTheLargest) {
  const std::vector<double> a = {1.0, kNan, -4.0, kInfinity};
  std::vector<double> b = a;
  EXPECT_TRUE(compare_numbers(a, b).identical);
  b[0] = 1.5;
  EXPECT_FALSE(compare_numbers(a, b).identical);
  EXPECT_EQ(compare_numbers(a, b).relative, 0.125);
  b[1] = 0.0;
  EXPECT_EQ(compare_numbers(a, b).relative, kInfinity);
  EXPECT_EQ(compare_numbers(a, b).fault, "1 of 4 values are not finite in one of them");
  b.pop_back();
  EXPECT_EQ(compare_numbers(a, b).fault, "4 and 3 values");
  const Difference zeros = compare_numbers(std::vector{0.0}, std::vector{-0.0});
  EXPECT_FALSE(zeros.identical);
  EXPECT_EQ(zeros.relative, 0.0);
}

TEST(ComplexDifference, NoOtherPhaseBringsThemNearer) {
  const Eigen::VectorXcd a = made_up_pressure(20, 0.5);
  const Difference same = compare_complex(a, a * std::polar(1.0, 0.7));
  EXPECT_NEAR(same.turn, 0.7, kRoundingOfSums);
  EXPECT_LT(same.relative, kRoundingOfSums);
  EXPECT_NEAR(same.as_it_is, 2.0 * std::sin(0.35), kRoundingOfSums);  // |exp(0.7 i) - 1|
  const Eigen::VectorXcd b = made_up_pressure(20, 0.6) * std::polar(1.0, 2.0);
  const Eigen::VectorXd weights = made_up_pressure(20, 3.0).cwiseAbs();
  const Difference found = compare_complex(a, b, weights);
  const auto weighted = [&](const Eigen::VectorXcd& p) { return weights.dot(p.cwiseAbs2()); };
  double least = kInfinity;
  for (int i = 0; i < 1000; ++i) {
    const Eigen::VectorXcd turned = b * std::polar(1.0, 2.0 * std::numbers::pi * i / 1000);
    least = std::min(least, std::sqrt(weighted(turned - a) / std::max(weighted(a), weighted(b))));
  }
  EXPECT_LE(found.relative, least + kRoundingOfSums);
  EXPECT_NEAR(found.relative, least, 1e-4);  // the search's steps of 0.006 rad, squared
  const Difference back = compare_complex(b, a, weights);
  EXPECT_NEAR(back.relative, found.relative, kRoundingOfSums);
  EXPECT_NEAR(back.turn, -found.turn, kRoundingOfSums);
}

TEST(PhasesDifference, IsWrappedAndFreeOfTheCommonPhase) {
  const Eigen::VectorXd a = Eigen::Vector4d(0.1, 2.0, 4.0, 6.2);
  const Eigen::VectorXd full = Eigen::VectorXd::Ones(4);
  const Eigen::VectorXd b = a.unaryExpr([](double phase) { return std::fmod(phase + 0.5, 2.0 * std::numbers::pi); });
  const Difference common = compare_phases(a, full, b, full);
  EXPECT_NEAR(common.turn, 0.5, kRoundingOfSums);
  EXPECT_LT(common.relative, kRoundingOfSums);
  EXPECT_FALSE(common.identical);
  // d on one of four channels: the common phase is atan(sin d / (3 + cos d)).
  Eigen::VectorXd one = a;
  one(2) += 0.2 + 2.0 * std::numbers::pi;
  const double turn = std::atan2(std::sin(0.2), 3.0 + std::cos(0.2));
  EXPECT_NEAR(compare_phases(a, full, one, full).turn, turn, kRoundingOfSums);
  EXPECT_NEAR(compare_phases(a, full, one, full).relative, 0.2 - turn, kRoundingOfSums);
  // A silent channel does not count.
  const Eigen::VectorXd silent = Eigen::Vector4d(1, 1, 0, 1);
  EXPECT_LT(compare_phases(a, silent, one, silent).relative, kRoundingOfSums);
  EXPECT_GT(compare_phases(a, silent, one, full).relative, 0.1);
  EXPECT_EQ(compare_phases(a, full, b.head(2), full).relative, kInfinity);
}

TEST(CompareRuns, ARunIsIdenticalToItself) {
  for (const RunData& run : {full_run(), self_evaluated_run(), bare_run(sheet(1, 1, 0.01))}) {
    const RunDifference difference = compared(run, run);
    EXPECT_EQ(difference.verdict(), "identical");
    EXPECT_TRUE(difference.largest.what.empty());
    EXPECT_EQ(difference.largest.relative, 0.0);
    EXPECT_THAT(describe_difference(difference), HasSubstr("verdict   identical"));
  }
}

/// A change to a run, and what the comparison must name as the largest deviation.
struct Change {
  std::function<void(RunData&)> make;
  std::string named;
  bool of_result = true;
};

TEST(CompareRuns, EveryPartIsLookedAt) {
  const std::vector<Change> changes = {
      {[](RunData& run) { run.methods[0].solution.phases(2) += 0.3; }, "phases of surface"},
      {[](RunData& run) { run.methods[0].solution.amplitudes(2) *= 0.9; }, "amplitudes of surface"},
      {[](RunData& run) { run.methods[1].pressure(0) *= 2.0; }, "pressure of paper-2"},
      {[](RunData& run) { run.methods[1].evaluation_pressure(0) *= 2.0; }, "evaluation's pressure of paper-2"},
      {[](RunData& run) { run.methods[0].metrics.leakage = 0.5; }, "leakage of surface"},
      {[](RunData& run) { run.methods[0].metrics.relative_error = kNan; }, "relative_error of surface"},
      {[](RunData& run) { run.fields[1].pressure[0].second(5) *= 3.0; }, "field cube of surface"},
      {[](RunData& run) { run.fields[0].inside[0] ^= 1U; }, "field side: the points inside bodies"},
      {[](RunData& run) { run.fields[0].grid.origin.x() += 1e-3; }, "field side: its points"},
      {[](RunData& run) { run.fields.pop_back(); }, "field cube is in A alone"},
      {[](RunData& run) { run.methods.push_back(made_up_method("third", run, 1.0)); }, "method third is in B alone"},
      {[](RunData& run) { run.mesh = sheet(2, 2, 0.01); }, "the mesh", false},
      {[](RunData& run) { run.mesh = transformed(run.mesh, Eigen::Matrix3d::Identity(), Vector3(0, 0, 1e-3)); },
       "the mesh", false},
      {[](RunData& run) { run.array.positions(0, 0) += 1e-3; }, "the array", false},
      {[](RunData& run) { run.array.device(1) = 1; }, "the array", false},
      {[](RunData& run) { run.array.directivity = Directivity::omni(); }, "the array", false},
      {[](RunData& run) { run.array.response = made_up_response(6, 0.9); }, "the array", false},
      {[](RunData& run) {
         run.array_truth = {made_up_response(6, 0.9), 0};
       },
       "the array", false},
      {[](RunData& run) { run.target->amplitudes(1) = 1500.0; }, "the target", false},
      {[](RunData& run) { run.target->faces[0] = 2; }, "the target", false},
      {[](RunData& run) { run.evaluation_model->scheme = "chief"; }, "the evaluation", false},
      {[](RunData& run) { run.evaluation_model->target->amplitudes(1) = 8.0; }, "the evaluation", false},
  };
  for (const Change& change : changes) {
    SCOPED_TRACE(change.named);
    const RunDifference difference = changed(change.make);
    EXPECT_EQ(difference.verdict(), "different");
    EXPECT_EQ(difference.largest.what, change.named);
    EXPECT_EQ(difference.largest_result.what, change.of_result ? change.named : "");
    EXPECT_THAT(describe_difference(difference), HasSubstr(change.named));
    // Which of the two comes first makes no difference.
    RunData run = full_run();
    change.make(run);
    EXPECT_LT(relative_change(compared(run, full_run()).largest.relative, difference.largest.relative),
              kRoundingOfSums);
  }
}

TEST(CompareRuns, RoundingIsTold) {
  const auto scale = [](double factor) {
    return [factor](RunData& run) { run.methods[0].metrics.relative_error *= factor; };
  };
  const RunDifference rounded = changed(scale(1.0 + 1e-9));
  EXPECT_EQ(rounded.verdict(), "same_to_rounding");
  EXPECT_NEAR(rounded.largest.relative, 1e-9, 1e-15);  // of numbers of size 1 with rounding 1e-16
  EXPECT_EQ(changed(scale(1.0 + 1e-5)).verdict(), "different");
  RunData single = full_run();
  single.solves[0].precision = "single";
  RunData other = single;
  scale(1.0 + 1e-5)(other);
  EXPECT_EQ(compared(single, other).verdict(), "same_to_rounding");
  scale(1.0 + 1e-3)(other);
  EXPECT_EQ(compared(single, other).verdict(), "different");
}

}  // namespace touchfield::run_compare_test
