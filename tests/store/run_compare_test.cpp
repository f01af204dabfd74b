#include "sim/store/run_compare.h"

#include <algorithm>
#include <functional>
#include <numbers>

#include <Eigen/Geometry>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/output_support.h"

namespace touchfield {
namespace {

using support::bare_run;
using support::full_run;
using support::made_up_method;
using support::made_up_pressure;
using support::RunData;
using support::self_judged_run;
using support::sheet;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::StartsWith;

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

TEST(RelativeChange, IsRelativeToTheLarger) {
  EXPECT_EQ(relative_change(0.0, 0.0), 0.0);
  EXPECT_EQ(relative_change(0.0, -0.0), 0.0);
  EXPECT_EQ(relative_change(4.0, 5.0), 0.2);
  EXPECT_EQ(relative_change(5.0, 4.0), 0.2);
  EXPECT_EQ(relative_change(1.0, -1.0), 2.0);
  EXPECT_EQ(relative_change(0.0, 1e-300), 1.0);
  EXPECT_EQ(relative_change(kNan, -kNan), 0.0);
  EXPECT_EQ(relative_change(kInfinity, kInfinity), 0.0);
  EXPECT_EQ(relative_change(kNan, 1.0), kInfinity);
  EXPECT_EQ(relative_change(kInfinity, -kInfinity), kInfinity);
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
  EXPECT_TRUE(compare_numbers({}, {}).identical);
}

TEST(NumbersDifference, ASignOfZeroIsNotIdenticalButNothing) {
  const NumbersDifference zeros = compare_numbers(std::vector{0.0}, std::vector{-0.0});
  EXPECT_FALSE(zeros.identical);
  EXPECT_EQ(zeros.relative, 0.0);
}

TEST(ComplexDifference, ACommonPhaseIsTakenOut) {
  const Eigen::VectorXcd a = made_up_pressure(20, 0.5);
  const ComplexDifference turned = compare_complex(a, a * std::polar(1.0, 0.7), {});
  EXPECT_FALSE(turned.identical);
  EXPECT_NEAR(turned.turn, 0.7, kRoundingOfSums);
  EXPECT_LT(turned.relative, kRoundingOfSums);
  EXPECT_NEAR(turned.as_is, 2.0 * std::sin(0.35), kRoundingOfSums);  // |exp(0.7 i) - 1|
}

TEST(ComplexDifference, NoOtherPhaseBringsThemNearer) {
  const Eigen::VectorXcd a = made_up_pressure(20, 0.5);
  const Eigen::VectorXcd b = made_up_pressure(20, 0.6) * std::polar(1.0, 2.0);
  const Eigen::VectorXd weights = made_up_pressure(20, 3.0).cwiseAbs();
  const ComplexDifference found = compare_complex(a, b, weights);
  const auto weighted = [&](const Eigen::VectorXcd& p) { return weights.dot(p.cwiseAbs2()); };
  double least = kInfinity;
  for (int i = 0; i < 1000; ++i) {
    const Eigen::VectorXcd turned = b * std::polar(1.0, 2.0 * std::numbers::pi * i / 1000);
    least = std::min(least, std::sqrt(weighted(turned - a) / std::max(weighted(a), weighted(b))));
  }
  EXPECT_LE(found.relative, least + kRoundingOfSums);
  EXPECT_NEAR(found.relative, least, 1e-4);  // the search's steps of 0.006 rad, squared
  const ComplexDifference back = compare_complex(b, a, weights);
  EXPECT_NEAR(back.relative, found.relative, kRoundingOfSums);
  EXPECT_NEAR(back.turn, -found.turn, kRoundingOfSums);
}

TEST(ComplexDifference, WeighsByArea) {
  const Eigen::VectorXcd a = Eigen::VectorXcd::Ones(2);
  Eigen::VectorXcd b = a;
  b(0) = 0.0;
  EXPECT_DOUBLE_EQ(compare_complex(a, b, Eigen::Vector2d(1, 3)).relative, 0.5);  // sqrt(1 / (1 + 3))
  EXPECT_EQ(compare_complex(a, b, Eigen::Vector2d(0, 3)).relative, 0.0);
}

TEST(ComplexDifference, WhatIsNoNumberInBothIsLeftOut) {
  Eigen::VectorXcd a = made_up_pressure(5, 0.5);
  a(1) = {kNan, 1.0};
  a(2) = {kInfinity, 0.0};
  Eigen::VectorXcd b = a;
  EXPECT_TRUE(compare_complex(a, b, {}).identical);
  b(3) *= 1.0 + 1e-9;
  const ComplexDifference small = compare_complex(a, b, {});
  EXPECT_GT(small.relative, 1e-11);
  EXPECT_LT(small.relative, 1e-9);
  b(1) = 1.0;
  EXPECT_EQ(compare_complex(a, b, {}).relative, kInfinity);
  EXPECT_THAT(compare_complex(a, b, {}).fault, StartsWith("1 of 5 values"));
  EXPECT_EQ(compare_complex(a, a.head(4), {}).fault, "5 and 4 values");
  EXPECT_TRUE(compare_complex({}, {}, {}).identical);
}

TEST(ComplexDifference, SilenceIsWhollyApartFromSound) {
  const Eigen::VectorXcd silence = Eigen::VectorXcd::Zero(4);
  EXPECT_EQ(compare_complex(silence, made_up_pressure(4, 1.0), {}).relative, 1.0);
  EXPECT_EQ(compare_complex(silence, -silence, {}).relative, 0.0);
}

TEST(PhasesDifference, IsWrappedAndFreeOfTheCommonPhase) {
  constexpr double kTwoPi = 2.0 * std::numbers::pi;
  Eigen::VectorXd a(4);
  a << 0.1, 2.0, 4.0, 6.2;
  const Eigen::VectorXd full = Eigen::VectorXd::Ones(4);
  const Eigen::VectorXd b =
      (a.array() + 0.5).unaryExpr([](double phase) { return std::fmod(phase, 6.28318530717958); });
  const PhasesDifference common = compare_phases(a, full, b, full);
  EXPECT_NEAR(common.turn, 0.5, 1e-12);  // the wrap above has 15 digits
  EXPECT_LT(common.largest, 1e-12);
  EXPECT_FALSE(common.identical);

  // d on one of four channels: the common phase is atan(sin d / (3 + cos d)).
  Eigen::VectorXd one = a;
  one(2) += 0.2 + kTwoPi;
  const PhasesDifference single = compare_phases(a, full, one, full);
  const double turn = std::atan2(std::sin(0.2), 3.0 + std::cos(0.2));
  EXPECT_NEAR(single.turn, turn, kRoundingOfSums);
  EXPECT_NEAR(single.largest, 0.2 - turn, kRoundingOfSums);
  EXPECT_NEAR(single.rms, std::sqrt((std::pow(0.2 - turn, 2) + 3.0 * turn * turn) / 4.0), kRoundingOfSums);
}

TEST(PhasesDifference, OfASilentChannelDoesNotCount) {
  const Eigen::VectorXd a = Eigen::Vector3d(1, 2, 3);
  const Eigen::VectorXd b = Eigen::Vector3d(1, 2, 5);
  const Eigen::VectorXd silent = Eigen::Vector3d(1, 1, 0);
  const PhasesDifference difference = compare_phases(a, silent, b, silent);
  EXPECT_EQ(difference.largest, 0.0);
  EXPECT_FALSE(difference.identical);
  EXPECT_GT(compare_phases(a, silent, b, Eigen::Vector3d(1, 1, 0.5)).largest, 1.0);
  EXPECT_EQ(compare_phases(a, silent, b.head(2), silent.head(2)).largest, kInfinity);
}

TEST(MeshDifference, ARigidMotionIsRecognised) {
  const TriangleMesh mesh = sheet(6, 4, 0.01);
  const Eigen::Matrix3d rotation = Eigen::AngleAxisd(0.3, Vector3(1, 2, 3).normalized()).toRotationMatrix();
  const Vector3 centre = mesh.vertices().rowwise().mean();
  const Vector3 shift(0.001, -0.002, 0.005);
  const TriangleMesh other = transformed(mesh, rotation, centre + shift - rotation * centre);
  const MeshDifference difference = compare_meshes(mesh, other);
  EXPECT_FALSE(difference.identical);
  EXPECT_TRUE(difference.same_triangles);
  ASSERT_TRUE(difference.motion);
  EXPECT_LT((difference.motion->shift - shift).norm(), 1e-15);  // rounding of lengths of 0.2 m
  EXPECT_NEAR(difference.motion->angle, 0.3, 1e-13);
  EXPECT_LT(difference.motion->residual, 1e-15);
  EXPECT_EQ(*difference.distance, (mesh.vertices() - other.vertices()).colwise().norm().maxCoeff());
  const auto diagonal = [](const Points& points) {
    return (points.rowwise().maxCoeff() - points.rowwise().minCoeff()).norm();
  };
  EXPECT_GT(diagonal(other.vertices()), diagonal(mesh.vertices()));
  EXPECT_DOUBLE_EQ(difference.relative, *difference.distance / diagonal(other.vertices()));
}

TEST(MeshDifference, ADentIsWhatAMotionLeaves) {
  const TriangleMesh mesh = sheet(6, 4, 0.01);
  Points vertices = mesh.vertices();
  vertices(2, 17) += 0.002;
  const MeshDifference difference = compare_meshes(mesh, {vertices, mesh.triangles()});
  EXPECT_NEAR(*difference.distance, 0.002, 1e-15);
  EXPECT_GT(difference.motion->residual, 0.0015);
  EXPECT_NEAR(difference.relative, 0.002 / std::hypot(0.06, 0.04, 0.002), 1e-15);  // rounding of 0.2 m
}

TEST(MeshDifference, OtherTrianglesAreAnotherMesh) {
  const TriangleMesh mesh = sheet(2, 2, 0.01);
  EXPECT_TRUE(compare_meshes(mesh, mesh).identical);
  Triangles inside_out = mesh.triangles();
  inside_out.row(0).swap(inside_out.row(1));
  for (const TriangleMesh& other : {TriangleMesh(mesh.vertices(), inside_out), sheet(3, 2, 0.01)}) {
    const MeshDifference difference = compare_meshes(mesh, other);
    EXPECT_FALSE(difference.identical);
    EXPECT_FALSE(difference.motion);
    EXPECT_EQ(difference.relative, kInfinity);
    EXPECT_EQ(difference.distance.has_value(), other.vertex_count() == mesh.vertex_count());
  }
}

TEST(ArrayDifference, SaysWhatDiffers) {
  const TransducerArray array = bare_run(sheet(1, 1, 0.01)).array;  // 3 x 2 at 10 mm: diagonal sqrt(5) cm
  EXPECT_TRUE(compare_arrays(array, array).identical);
  TransducerArray other = array;
  other.positions.row(2).array() += 0.005;
  EXPECT_DOUBLE_EQ(*compare_arrays(array, other).distance, 0.005);
  EXPECT_DOUBLE_EQ(compare_arrays(array, other).relative, 0.005 / (0.01 * std::sqrt(5.0)));
  other = array;
  other.axes.col(3) = Vector3(std::sin(0.1), 0, std::cos(0.1));
  EXPECT_NEAR(*compare_arrays(array, other).tilt, 0.1, kRoundingOfSums);
  other = array;
  other.amplitudes(1) *= 2.0;
  EXPECT_EQ(compare_arrays(array, other).relative, 0.5);
  other = array;
  other.device(1) = 1;
  EXPECT_EQ(compare_arrays(array, other).relative, kInfinity);
  other = array;
  other.directivity = Directivity::omni();
  EXPECT_EQ(compare_arrays(array, other).texts.front().what, "directivity");
  const ArrayDifference kinds = compare_arrays(array, plane_wave(Vector3(0, 0, 1), 1.0));
  EXPECT_EQ(kinds.texts.front().what, "kind");
  EXPECT_FALSE(kinds.distance);
  EXPECT_EQ(kinds.relative, kInfinity);
}

TEST(TargetDifference, CountsFacesOfOneAlone) {
  const std::optional<Target> target = full_run().target;  // faces 3, 4, 10 at 1000, 2000, 1e-3 Pa
  EXPECT_TRUE(compare_targets(target, target).identical);
  EXPECT_TRUE(compare_targets(std::nullopt, std::nullopt).identical);
  std::optional<Target> other = target;
  other->box[2] = 0;
  EXPECT_FALSE(compare_targets(target, other).identical);
  EXPECT_EQ(compare_targets(target, other).relative, 0.0);
  other = target;
  other->faces[0] = 2;
  other->amplitudes(1) = 1500;
  const TargetDifference difference = compare_targets(target, other);
  EXPECT_EQ(difference.only_faces, (std::pair<Eigen::Index, Eigen::Index>(1, 1)));
  EXPECT_EQ(difference.amplitudes.relative, 0.25);
  EXPECT_EQ(difference.relative, kInfinity);
  EXPECT_EQ(compare_targets(std::nullopt, target).only_faces.second, 3);
}

TEST(CompareRuns, ARunIsIdenticalToItself) {
  for (const RunData& run : {full_run(), self_judged_run(), bare_run(sheet(1, 1, 0.01))}) {
    const RunDifference difference = compared(run, run);
    EXPECT_EQ(difference.verdict, Verdict::kIdentical);
    EXPECT_TRUE(difference.largest.what.empty());
    EXPECT_EQ(difference.largest.relative, 0.0);
    EXPECT_THAT(difference.causes, IsEmpty());
    EXPECT_THAT(difference.provenance, IsEmpty());
    EXPECT_THAT(describe_difference(difference), HasSubstr("verdict   identical"));
  }
}

TEST(CompareRuns, TimesAndWhatIsRecordedAreShownAndDoNotCount) {
  const RunDifference difference = changed([](RunData& run) {
    run.provenance.start = "2027-01-01T00:00:00Z";
    run.provenance.end = "2027-01-01T00:00:01Z";
    run.provenance.threads = 16;
    run.provenance.machine = "another";
    run.methods[0].metrics.seconds_solve = 99.0;
    run.methods[0].metrics.seconds_total = 99.0;
    run.methods[0].seconds = {{"solve", 99.0}};
    run.solves[0].seconds = 99.0;
    run.alarm = 0.5;
  });
  EXPECT_EQ(difference.verdict, Verdict::kIdentical);
  ASSERT_EQ(difference.provenance.size(), 2U);
  EXPECT_EQ(difference.provenance[0].what, "machine");
  EXPECT_EQ(difference.provenance[1].what, "threads");
  EXPECT_EQ(difference.provenance[1].b, "16");
  const auto& seconds = difference.both_methods[0].seconds;
  EXPECT_EQ(seconds.back().name, "seconds_total");
  EXPECT_EQ(seconds.back().b, 99.0);
  EXPECT_THAT(describe_difference(difference), AllOf(HasSubstr("threads   2 -> 16\n"), HasSubstr("99.00")));
}

/// A change to a run, and what the comparison must name as the largest deviation.
struct Change {
  std::function<void(RunData&)> make;
  std::string named;
  bool of_result;
};

TEST(CompareRuns, EveryPartIsLookedAt) {
  const std::vector<Change> changes = {
      {[](RunData& run) { run.methods[0].solution.phases(2) += 0.3; }, "phases of surface", true},
      {[](RunData& run) { run.methods[0].solution.amplitudes(2) *= 0.9; }, "amplitudes of surface", true},
      {[](RunData& run) { run.methods[1].pressure(0) *= 2.0; }, "pressure of paper-2", true},
      {[](RunData& run) { run.methods[1].judge_pressure(0) *= 2.0; }, "judge's pressure of paper-2", true},
      {[](RunData& run) { run.methods[0].metrics.leakage = 0.5; }, "leakage of surface", true},
      {[](RunData& run) { run.methods[0].metrics.width_mm = 5.5; }, "width_mm of surface", true},
      {[](RunData& run) { run.fields[1].pressure[0].second(5) *= 3.0; }, "field cube of surface", true},
      {[](RunData& run) { run.fields[0].inside[0] ^= 1U; }, "field side: the points inside bodies", true},
      {[](RunData& run) { run.fields[0].grid.origin.x() += 1e-3; }, "field side: its grid", true},
      {[](RunData& run) { run.fields.pop_back(); }, "field cube is in A alone", true},
      {[](RunData& run) { run.methods.push_back(made_up_method("third", run, 1.0)); }, "method third is in B alone",
       true},
      {[](RunData& run) { run.mesh = transformed(run.mesh, Eigen::Matrix3d::Identity(), Vector3(0, 0, 1e-3)); },
       "the mesh", false},
      {[](RunData& run) { run.array.positions(0, 0) += 1e-3; }, "the array", false},
      {[](RunData& run) { run.target->amplitudes(1) = 1500.0; }, "the target", false},
      {[](RunData& run) { run.judge_model->scheme = "chief"; }, "the judge", false},
      {[](RunData& run) { run.judge_model->target->amplitudes(1) = 8.0; }, "the judge's target", false},
  };
  for (const Change& change : changes) {
    SCOPED_TRACE(change.named);
    const RunDifference difference = changed(change.make);
    EXPECT_EQ(difference.verdict, Verdict::kDifferent);
    EXPECT_EQ(difference.largest.what, change.named);
    EXPECT_EQ(difference.largest_result.what, change.of_result ? change.named : "");
    EXPECT_THAT(describe_difference(difference), HasSubstr(change.named));
    // Which of the two comes first makes no difference.
    RunData run = full_run();
    change.make(run);
    const double swapped = compared(run, full_run()).largest_result.relative;
    EXPECT_LT(relative_change(swapped, difference.largest_result.relative), kRoundingOfSums);
  }
}

TEST(CompareRuns, SizesThatDifferAreReported) {
  RunData other = bare_run(sheet(2, 2, 0.01));
  other.array = make_array(grid_layout(2, 2, 0.01), Directivity::t4010a1(), 0.5, 4.0);
  other.methods.push_back(made_up_method("surface", other, 0.25));
  const RunDifference difference = compared(full_run(), other);
  EXPECT_EQ(difference.verdict, Verdict::kDifferent);
  EXPECT_EQ(difference.both_methods.at(0).pressure.fault, "48 and 8 values");
  EXPECT_EQ(difference.both_methods.at(0).phases.fault, "6 and 4 values");
  EXPECT_EQ(difference.both_methods.at(0).judge_pressure->fault, "80 and 0 values");
  EXPECT_EQ(difference.methods.a, std::vector<std::string>{"paper-2"});
  EXPECT_EQ(difference.fields.a, (std::vector<std::string>{"cube", "side"}));
  EXPECT_THAT(describe_difference(difference),
              AllOf(HasSubstr("mesh      another: 48 -> 8 faces"), HasSubstr("array     6 -> 4 channels"),
                    HasSubstr("target    3 -> 0 faces"), HasSubstr("judge     edge -> none"),
                    HasSubstr("pressure: 48 and 8 values"), HasSubstr("in A alone: paper-2")));
}

TEST(CompareRuns, RoundingIsTold) {
  const auto scale = [](double factor) {
    return [factor](RunData& run) { run.methods[0].metrics.relative_error *= factor; };
  };
  const RunDifference rounded = changed(scale(1.0 + 1e-9));
  EXPECT_EQ(rounded.verdict, Verdict::kRounding);
  EXPECT_NEAR(rounded.largest.relative, 1e-9, 1e-15);  // of numbers of size 1 with rounding 1e-16
  EXPECT_EQ(changed(scale(1.0 + 1e-5)).verdict, Verdict::kDifferent);
  RunData single = full_run();
  single.solves[0].precision = "single";
  RunData other = single;
  scale(1.0 + 1e-5)(other);
  EXPECT_EQ(compared(single, other).verdict, Verdict::kRounding);
  scale(1.0 + 1e-3)(other);
  EXPECT_EQ(compared(single, other).verdict, Verdict::kDifferent);
}

TEST(CompareRuns, ACommonPhaseOfAllDrivesIsRounding) {
  const RunDifference difference = changed([](RunData& run) {
    MethodResult& method = run.methods[0];
    method.solution.phases.array() += 1.0;
    method.pressure *= std::polar(1.0, 1.0);
    method.judge_pressure *= std::polar(1.0, 1.0);
    for (FieldResult& field : run.fields) {
      field.pressure[0].second *= std::polar(1.0, 1.0);
    }
  });
  EXPECT_EQ(difference.verdict, Verdict::kRounding);
  EXPECT_NEAR(difference.both_methods[0].phases.turn, 1.0, kRoundingOfSums);
  EXPECT_NEAR(difference.both_methods[0].pressure.as_is, 2.0 * std::sin(0.5), kRoundingOfSums);
}

TEST(CompareRuns, AStatusOrACostIsNotIdentical) {
  const RunDifference status = changed([](RunData& run) { run.methods[0].solution.status = PhaseStatus::kConverged; });
  EXPECT_EQ(status.verdict, Verdict::kRounding);
  EXPECT_THAT(describe_difference(status), HasSubstr("surface: status stalled -> converged"));
  const RunDifference cost = changed([](RunData& run) { run.methods[0].solution.cost_history.pop_back(); });
  EXPECT_EQ(cost.verdict, Verdict::kRounding);
  EXPECT_THAT(describe_difference(cost), HasSubstr("cost history of 3 -> 2 values"));
}

TEST(CompareRuns, AMetricThatIsMissingInOneIsDifferent) {
  const RunDifference difference = changed([](RunData& run) { run.methods[0].metrics.relative_error = kNan; });
  EXPECT_EQ(difference.verdict, Verdict::kDifferent);
  EXPECT_EQ(difference.largest_result.relative, kInfinity);
  EXPECT_EQ(difference.largest_result.what, "relative_error of surface");
}

// Where the judge is the solving model, a method's own pressure is the judge's unless there is another.
TEST(CompareRuns, TheJudgesPressureMayBeTheMethodsOwn) {
  const RunData a = self_judged_run();
  RunData b = a;
  b.methods[1].judge_pressure = b.methods[1].pressure;
  RunData c = a;
  c.methods[1].judge_pressure.resize(0);
  EXPECT_EQ(compared(b, c).verdict, Verdict::kIdentical);
  const RunDifference difference = compared(a, c);
  EXPECT_FALSE(difference.both_methods[0].judge_pressure);
  EXPECT_FALSE(difference.both_methods[1].judge_pressure->identical);
}

TEST(CompareRuns, CausesComeInTheOrderOfLikelihood) {
  RunData a = full_run();
  RunData b = full_run();
  a.methods[0].metrics.relative_error = 0.5;
  EXPECT_THAT(compared(a, b).causes, ElementsAre(StartsWith("nothing that is recorded")));
  b.provenance.machine = "another";
  b.provenance.threads = 1;
  b.solves[0].solver = "LU";
  b.provenance.flags = "-O0";
  b.provenance.revision = "ba9876543210";
  b.complete = false;
  const std::vector<TextChange> scene = {
      {"name", "a", "b"},           {"write[1]", "vtp", "vti"}, {"solve.iterations", "30", "40"},
      {"array.at_mm[2]", "0", "5"}, {"judge", "same", "none"},  {"body.edge_mm", "2", "3"}};
  EXPECT_THAT(compare_runs(a, b, {scene, {}}).causes,
              ElementsAre("B is not complete", "the scene: solve.iterations, array.at_mm[2], judge and 1 more",
                          "the program: 0123456789ab -> ba9876543210", "the build: -O3 -> -O0",
                          "the solver of pressure: GMRES, matrix-free, single refined -> LU, single refined",
                          "threads: 2 -> 1", "the machine: host, processor, 2 logical cores -> another"));
  // Names and files change no number.
  EXPECT_THAT(compare_runs(a, full_run(), {{scene[0], scene[1]}, {}}).causes, ElementsAre(StartsWith("nothing that")));
}

TEST(CompareRuns, SourcesThatWereNotCommittedAreACause) {
  RunData a = full_run();
  a.provenance.revision = "0123-dirty";
  RunData b = a;
  b.methods[0].metrics.relative_error = 0.5;
  b.provenance.threads = 1;
  EXPECT_THAT(compared(a, b).causes, ElementsAre("threads: 2 -> 1", HasSubstr("0123-dirty may be two programs")));
}

TEST(CompareRuns, FilesThatASceneNamesAreACause) {
  RunData a = full_run();
  a.scene = "body:\n  mesh:\n    file: hand.stl\n";
  RunData b = a;
  b.methods[0].metrics.relative_error = 0.5;
  EXPECT_THAT(compared(a, b).causes, ElementsAre(StartsWith("nothing that")));  // the mesh is the same
  b.mesh = transformed(b.mesh, Eigen::Matrix3d::Identity(), Vector3(0, 0, 1e-3));
  EXPECT_THAT(compared(a, b).causes, ElementsAre(HasSubstr("a mesh or a table")));
  a.scene = b.scene = "solve:\n  start:\n    previous: old/run.h5\n";
  EXPECT_THAT(compared(a, b).causes, ElementsAre(HasSubstr("phases that the scene reads")));
}

TEST(CompareRuns, FiguresOfAPartAndOfTheWholeAreNotComparable) {
  const RunDifference difference = changed([](RunData& run) { run.judged_skin = SkinExtent::kPart; });
  EXPECT_EQ(difference.verdict, Verdict::kDifferent);
  EXPECT_EQ(difference.largest.what, "the skin that is evaluated");
  EXPECT_THAT(describe_difference(difference), HasSubstr("skin      A evaluates the whole skin, B the part within "
                                                         "keep_within_mm: their metrics are not comparable\n"));
  EXPECT_THAT(describe_difference(changed([](RunData&) {})), Not(HasSubstr("evaluates")));
}

TEST(CompareRuns, WarningsAreComparedByName) {
  const RunDifference difference = changed([](RunData& run) {
    run.warnings = {"coarse mesh", "ill_conditioned: about 1e9"};
    run.notes = {"nonlinear: 0.4", "beyond: at 40 mm"};
  });
  EXPECT_THAT(difference.warnings.a, ElementsAre("two, with \"quotes\""));
  EXPECT_THAT(difference.warnings.b, ElementsAre("ill_conditioned"));
  EXPECT_THAT(difference.notes.a, IsEmpty());
  EXPECT_THAT(difference.notes.b, ElementsAre("nonlinear"));
  EXPECT_EQ(difference.verdict, Verdict::kIdentical);
}

TEST(DescribeDifference, SaysWhatAPersonAsks) {
  RunData b = full_run();
  b.mesh = transformed(b.mesh, Eigen::Matrix3d::Identity(), Vector3(0.001, 0, 0.005));
  b.methods[0].metrics.width_mm = 10.5;
  b.provenance.command_line = "touchfield run scene.yaml -o somewhere/else/where/the/path/is/long/enough/for/two/lines";
  std::vector<TextChange> scene = {{"array.at_mm[2]", "0", "5"},
                                   {"solve.quiet_weight", std::nullopt, "2"},
                                   {"body.long", std::string(100, 'x'), ""}};
  const std::string text = describe_difference(
      compare_runs(full_run(), b, {scene, {{"judge.whole"}, {"solve.methods[0].paper.faces", "array.level"}}}));
  for (const char* part :
       {"command   A: touchfield run scene.yaml\n          B: touchfield run scene.yaml -o", "array.at_mm[2]: 0 -> 5\n",
        "          A lacks 2 keys that B has at their defaults: solve.methods[0].paper.faces, array.level\n",
        "          B lacks 1 key that A has at its default: judge.whole\n", "solve.quiet_weight: (absent) -> 2\n",
        "body.long: xxxxx", "... -> (empty)\n",
        "mesh      the same 48 faces with vertices up to 5.099 mm apart: shifted by (1, 0, 5) mm as a whole\n",
        "array     the same: 6 channels\n", "target    the same: 3 faces\n", "judge     mesh: the same: 80 faces\n",
        "  surface  width_mm  5.25  10.5   5.0e-01\n", "verdict   different: up to 0.5 relative, width_mm of surface\n",
        "cause     the scene: array.at_mm[2], solve.quiet_weight, body.long\n"}) {
    EXPECT_THAT(text, HasSubstr(part));
  }
  EXPECT_THAT(text, Not(HasSubstr("nan")));
}

TEST(DescribeDifference, SaysHowAMeshMoved) {
  const auto text_of = [](const TriangleMesh& other) {
    return describe_difference(changed([&](RunData& run) { run.mesh = other; }));
  };
  const TriangleMesh mesh = full_run().mesh;
  const Eigen::Matrix3d quarter = Eigen::AngleAxisd(std::numbers::pi / 2, Vector3::UnitZ()).toRotationMatrix();
  EXPECT_THAT(text_of(transformed(mesh, quarter, Vector3::Zero())),
              HasSubstr("shifted by (0, 0, 0) mm and turned by 90 deg as a whole\n"));
  Points dented = mesh.vertices();
  dented(2, 17) += 0.002;
  EXPECT_THAT(text_of({dented, mesh.triangles()}), HasSubstr("up to 2 mm apart: deformed by up to 1."));
}

TEST(DescribeDifference, AThousandKeysDoNotFillTheScreen) {
  std::vector<TextChange> scene(1000, {"array.positions.points_mm[0]", "1", "2"});
  const std::string text = describe_difference(compare_runs(full_run(), full_run(), {scene, {}}));
  EXPECT_LT(std::ranges::count(text, '\n'), 80);
  EXPECT_THAT(text, HasSubstr("and 960 more keys"));
}

}  // namespace
}  // namespace touchfield
