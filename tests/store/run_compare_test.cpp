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
using ::testing::ContainsRegex;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::StartsWith;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kRoundingOfSums = 1e-14;  // of some ten terms of size 1, with room

Value compared(const RunData& a, const RunData& b) { return compare_runs(a, b, {}); }

std::vector<std::string> texts(const Value& list) {
  std::vector<std::string> all;
  for (const Value& one : list.list()) {
    all.push_back(one.text());
  }
  return all;
}

Vector3 vector(const Value& list) {
  return {list.list()[0].number(), list.list()[1].number(), list.list()[2].number()};
}

/// full_run after a change against full_run as it is.
Value changed(const std::function<void(RunData&)>& change) {
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
  EXPECT_TRUE(compare_numbers(a, b)["identical"].flag());
  b[0] = 1.5;
  EXPECT_FALSE(compare_numbers(a, b)["identical"].flag());
  EXPECT_EQ(compare_numbers(a, b)["relative"].number(), 0.125);
  b[1] = 0.0;
  EXPECT_EQ(compare_numbers(a, b)["relative"].number(), kInfinity);
  EXPECT_EQ(compare_numbers(a, b)["fault"].text(), "1 of 4 values are not finite in one of them");
  b.pop_back();
  EXPECT_EQ(compare_numbers(a, b)["fault"].text(), "4 and 3 values");
  EXPECT_TRUE(compare_numbers({}, {})["identical"].flag());
}

TEST(NumbersDifference, ASignOfZeroIsNotIdenticalButNothing) {
  const Value zeros = compare_numbers(std::vector{0.0}, std::vector{-0.0});
  EXPECT_FALSE(zeros["identical"].flag());
  EXPECT_EQ(zeros["relative"].number(), 0.0);
}

TEST(ComplexDifference, ACommonPhaseIsTakenOut) {
  const Eigen::VectorXcd a = made_up_pressure(20, 0.5);
  const Value turned = compare_complex(a, a * std::polar(1.0, 0.7), {});
  EXPECT_FALSE(turned["identical"].flag());
  EXPECT_NEAR(turned["turn_rad"].number(), 0.7, kRoundingOfSums);
  EXPECT_LT(turned["relative"].number(), kRoundingOfSums);
  EXPECT_NEAR(turned["as_it_is"].number(), 2.0 * std::sin(0.35), kRoundingOfSums);  // |exp(0.7 i) - 1|
}

TEST(ComplexDifference, NoOtherPhaseBringsThemNearer) {
  const Eigen::VectorXcd a = made_up_pressure(20, 0.5);
  const Eigen::VectorXcd b = made_up_pressure(20, 0.6) * std::polar(1.0, 2.0);
  const Eigen::VectorXd weights = made_up_pressure(20, 3.0).cwiseAbs();
  const Value found = compare_complex(a, b, weights);
  const auto weighted = [&](const Eigen::VectorXcd& p) { return weights.dot(p.cwiseAbs2()); };
  double least = kInfinity;
  for (int i = 0; i < 1000; ++i) {
    const Eigen::VectorXcd turned = b * std::polar(1.0, 2.0 * std::numbers::pi * i / 1000);
    least = std::min(least, std::sqrt(weighted(turned - a) / std::max(weighted(a), weighted(b))));
  }
  EXPECT_LE(found["relative"].number(), least + kRoundingOfSums);
  EXPECT_NEAR(found["relative"].number(), least, 1e-4);  // the search's steps of 0.006 rad, squared
  const Value back = compare_complex(b, a, weights);
  EXPECT_NEAR(back["relative"].number(), found["relative"].number(), kRoundingOfSums);
  EXPECT_NEAR(back["turn_rad"].number(), -found["turn_rad"].number(), kRoundingOfSums);
}

TEST(ComplexDifference, WeighsByArea) {
  const Eigen::VectorXcd a = Eigen::VectorXcd::Ones(2);
  Eigen::VectorXcd b = a;
  b(0) = 0.0;
  EXPECT_DOUBLE_EQ(compare_complex(a, b, Eigen::Vector2d(1, 3))["relative"].number(), 0.5);  // sqrt(1 / (1 + 3))
  EXPECT_EQ(compare_complex(a, b, Eigen::Vector2d(0, 3))["relative"].number(), 0.0);
}

TEST(ComplexDifference, WhatIsNoNumberInBothIsLeftOut) {
  Eigen::VectorXcd a = made_up_pressure(5, 0.5);
  a(1) = {kNan, 1.0};
  a(2) = {kInfinity, 0.0};
  Eigen::VectorXcd b = a;
  EXPECT_TRUE(compare_complex(a, b, {})["identical"].flag());
  b(3) *= 1.0 + 1e-9;
  const Value small = compare_complex(a, b, {});
  EXPECT_GT(small["relative"].number(), 1e-11);
  EXPECT_LT(small["relative"].number(), 1e-9);
  b(1) = 1.0;
  EXPECT_EQ(compare_complex(a, b, {})["relative"].number(), kInfinity);
  EXPECT_THAT(compare_complex(a, b, {})["fault"].text(), StartsWith("1 of 5 values"));
  EXPECT_EQ(compare_complex(a, a.head(4), {})["fault"].text(), "5 and 4 values");
  EXPECT_TRUE(compare_complex({}, {}, {})["identical"].flag());
}

TEST(ComplexDifference, SilenceIsWhollyApartFromSound) {
  const Eigen::VectorXcd silence = Eigen::VectorXcd::Zero(4);
  EXPECT_EQ(compare_complex(silence, made_up_pressure(4, 1.0), {})["relative"].number(), 1.0);
  EXPECT_EQ(compare_complex(silence, -silence, {})["relative"].number(), 0.0);
}

TEST(PhasesDifference, IsWrappedAndFreeOfTheCommonPhase) {
  constexpr double kTwoPi = 2.0 * std::numbers::pi;
  Eigen::VectorXd a(4);
  a << 0.1, 2.0, 4.0, 6.2;
  const Eigen::VectorXd full = Eigen::VectorXd::Ones(4);
  const Eigen::VectorXd b =
      (a.array() + 0.5).unaryExpr([](double phase) { return std::fmod(phase, 6.28318530717958); });
  const Value common = compare_phases(a, full, b, full);
  EXPECT_NEAR(common["turn_rad"].number(), 0.5, 1e-12);  // the wrap above has 15 digits
  EXPECT_LT(common["largest_rad"].number(), 1e-12);
  EXPECT_FALSE(common["identical"].flag());

  // d on one of four channels: the common phase is atan(sin d / (3 + cos d)).
  Eigen::VectorXd one = a;
  one(2) += 0.2 + kTwoPi;
  const Value single = compare_phases(a, full, one, full);
  const double turn = std::atan2(std::sin(0.2), 3.0 + std::cos(0.2));
  EXPECT_NEAR(single["turn_rad"].number(), turn, kRoundingOfSums);
  EXPECT_NEAR(single["largest_rad"].number(), 0.2 - turn, kRoundingOfSums);
  EXPECT_NEAR(single["rms_rad"].number(), std::sqrt((std::pow(0.2 - turn, 2) + 3.0 * turn * turn) / 4.0),
              kRoundingOfSums);
}

TEST(PhasesDifference, OfASilentChannelDoesNotCount) {
  const Eigen::VectorXd a = Eigen::Vector3d(1, 2, 3);
  const Eigen::VectorXd b = Eigen::Vector3d(1, 2, 5);
  const Eigen::VectorXd silent = Eigen::Vector3d(1, 1, 0);
  const Value difference = compare_phases(a, silent, b, silent);
  EXPECT_EQ(difference["largest_rad"].number(), 0.0);
  EXPECT_FALSE(difference["identical"].flag());
  EXPECT_GT(compare_phases(a, silent, b, Eigen::Vector3d(1, 1, 0.5))["largest_rad"].number(), 1.0);
  EXPECT_EQ(compare_phases(a, silent, b.head(2), silent.head(2))["largest_rad"].number(), kInfinity);
}

TEST(MeshDifference, ARigidMotionIsRecognised) {
  const TriangleMesh mesh = sheet(6, 4, 0.01);
  const Eigen::Matrix3d rotation = Eigen::AngleAxisd(0.3, Vector3(1, 2, 3).normalized()).toRotationMatrix();
  const Vector3 centre = mesh.vertices().rowwise().mean();
  const Vector3 shift(0.001, -0.002, 0.005);
  const TriangleMesh other = transformed(mesh, rotation, centre + shift - rotation * centre);
  const Value difference = compare_meshes(mesh, other);
  EXPECT_FALSE(difference["identical"].flag());
  EXPECT_TRUE(difference["same_triangles"].flag());
  const Value& motion = difference["motion"];
  EXPECT_LT((vector(motion["shift_m"]) - shift).norm(), 1e-15);  // rounding of lengths of 0.2 m
  EXPECT_NEAR(motion["angle_rad"].number(), 0.3, 1e-13);
  EXPECT_LT(motion["residual_m"].number(), 1e-15);
  EXPECT_EQ(difference["largest_distance_m"].number(),
            (mesh.vertices() - other.vertices()).colwise().norm().maxCoeff());
  const auto diagonal = [](const Points& points) {
    return (points.rowwise().maxCoeff() - points.rowwise().minCoeff()).norm();
  };
  EXPECT_GT(diagonal(other.vertices()), diagonal(mesh.vertices()));
  EXPECT_DOUBLE_EQ(difference["relative"].number(),
                   difference["largest_distance_m"].number() / diagonal(other.vertices()));
}

TEST(MeshDifference, ADentIsWhatAMotionLeaves) {
  const TriangleMesh mesh = sheet(6, 4, 0.01);
  Points vertices = mesh.vertices();
  vertices(2, 17) += 0.002;
  const Value difference = compare_meshes(mesh, {vertices, mesh.triangles()});
  EXPECT_NEAR(difference["largest_distance_m"].number(), 0.002, 1e-15);
  EXPECT_GT(difference["motion"]["residual_m"].number(), 0.0015);
  EXPECT_NEAR(difference["relative"].number(), 0.002 / std::hypot(0.06, 0.04, 0.002), 1e-15);  // rounding of 0.2 m
}

TEST(MeshDifference, OtherTrianglesAreAnotherMesh) {
  const TriangleMesh mesh = sheet(2, 2, 0.01);
  EXPECT_TRUE(compare_meshes(mesh, mesh)["identical"].flag());
  Triangles inside_out = mesh.triangles();
  inside_out.row(0).swap(inside_out.row(1));
  for (const TriangleMesh& other : {TriangleMesh(mesh.vertices(), inside_out), sheet(3, 2, 0.01)}) {
    const Value difference = compare_meshes(mesh, other);
    EXPECT_FALSE(difference["identical"].flag());
    EXPECT_TRUE(difference["motion"].empty());
    EXPECT_EQ(difference["relative"].number(), kInfinity);
    EXPECT_EQ(std::isfinite(difference["largest_distance_m"].number()), other.vertex_count() == mesh.vertex_count());
  }
}

TEST(ArrayDifference, SaysWhatDiffers) {
  const TransducerArray array = bare_run(sheet(1, 1, 0.01)).array;  // 3 x 2 at 10 mm: diagonal sqrt(5) cm
  EXPECT_TRUE(compare_arrays(array, array)["identical"].flag());
  TransducerArray other = array;
  other.positions.row(2).array() += 0.005;
  EXPECT_DOUBLE_EQ(compare_arrays(array, other)["largest_distance_m"].number(), 0.005);
  EXPECT_DOUBLE_EQ(compare_arrays(array, other)["relative"].number(), 0.005 / (0.01 * std::sqrt(5.0)));
  other = array;
  other.axes.col(3) = Vector3(std::sin(0.1), 0, std::cos(0.1));
  EXPECT_NEAR(compare_arrays(array, other)["largest_tilt_rad"].number(), 0.1, kRoundingOfSums);
  other = array;
  other.amplitudes(1) *= 2.0;
  EXPECT_EQ(compare_arrays(array, other)["relative"].number(), 0.5);
  other = array;
  other.device(1) = 1;
  EXPECT_EQ(compare_arrays(array, other)["relative"].number(), kInfinity);
  other = array;
  other.directivity = Directivity::omni();
  EXPECT_EQ(compare_arrays(array, other)["changes"].group().front().name, "directivity");
  const Value kinds = compare_arrays(array, plane_wave(Vector3(0, 0, 1), 1.0));
  EXPECT_EQ(kinds["changes"].group().front().name, "kind");
  EXPECT_EQ(kinds["largest_distance_m"].number(), kInfinity);
  EXPECT_EQ(kinds["relative"].number(), kInfinity);
}

TEST(TargetDifference, CountsFacesOfOneAlone) {
  const std::optional<Target> target = full_run().target;  // faces 3, 4, 10 at 1000, 2000, 1e-3 Pa
  EXPECT_TRUE(compare_targets(target, target)["identical"].flag());
  EXPECT_TRUE(compare_targets(std::nullopt, std::nullopt)["identical"].flag());
  std::optional<Target> other = target;
  other->box[2] = 0;
  EXPECT_FALSE(compare_targets(target, other)["identical"].flag());
  EXPECT_EQ(compare_targets(target, other)["relative"].number(), 0.0);
  other = target;
  other->faces[0] = 2;
  other->amplitudes(1) = 1500;
  const Value difference = compare_targets(target, other);
  EXPECT_EQ(difference["faces_in_one_alone"].json(-1), R"({"a":1,"b":1})");
  EXPECT_EQ(difference["amplitudes"]["relative"].number(), 0.25);
  EXPECT_EQ(difference["relative"].number(), kInfinity);
  EXPECT_EQ(compare_targets(std::nullopt, target)["faces_in_one_alone"]["b"].count(), 3);
}

TEST(CompareRuns, ARunIsIdenticalToItself) {
  for (const RunData& run : {full_run(), self_judged_run(), bare_run(sheet(1, 1, 0.01))}) {
    const Value difference = compared(run, run);
    EXPECT_EQ(difference["verdict"].text(), "identical");
    EXPECT_TRUE(difference["largest"]["what"].text().empty());
    EXPECT_EQ(difference["largest"]["relative"].number(), 0.0);
    EXPECT_TRUE(difference["causes"].empty());
    EXPECT_TRUE(difference["provenance"].empty());
    EXPECT_THAT(describe_difference(difference), HasSubstr("verdict   identical"));
  }
}

TEST(CompareRuns, TimesAndWhatIsRecordedAreShownAndDoNotCount) {
  const Value difference = changed([](RunData& run) {
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
  EXPECT_EQ(difference["verdict"].text(), "identical");
  const Value::Group& provenance = difference["provenance"].group();
  ASSERT_EQ(provenance.size(), 2U);
  EXPECT_EQ(provenance[0].name, "machine");
  EXPECT_EQ(provenance[1].name, "threads");
  EXPECT_EQ(provenance[1].value["b"].text(), "16");
  const NamedValue& seconds = difference["methods"].list()[0]["seconds"].group().back();
  EXPECT_EQ(seconds.name, "seconds_total");
  EXPECT_EQ(seconds.value["b"].number(), 99.0);
  EXPECT_THAT(describe_difference(difference), AllOf(HasSubstr("threads   2 -> 16\n"), HasSubstr("     99\n")));
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
    const Value difference = changed(change.make);
    EXPECT_EQ(difference["verdict"].text(), "different");
    EXPECT_EQ(difference["largest"]["what"].text(), change.named);
    EXPECT_EQ(difference["largest_result"]["what"].text(), change.of_result ? change.named : "");
    EXPECT_THAT(describe_difference(difference), HasSubstr(change.named));
    // Which of the two comes first makes no difference.
    RunData run = full_run();
    change.make(run);
    const double swapped = compared(run, full_run())["largest_result"]["relative"].number();
    EXPECT_LT(relative_change(swapped, difference["largest_result"]["relative"].number()), kRoundingOfSums);
  }
}

TEST(CompareRuns, SizesThatDifferAreReported) {
  RunData other = bare_run(sheet(2, 2, 0.01));
  other.array = make_array(grid_layout(2, 2, 0.01), Directivity::t4010a1(), 0.5, 4.0);
  other.methods.push_back(made_up_method("surface", other, 0.25));
  const Value difference = compared(full_run(), other);
  EXPECT_EQ(difference["verdict"].text(), "different");
  EXPECT_EQ(difference["methods"].list().at(0)["pressure"]["fault"].text(), "48 and 8 values");
  EXPECT_EQ(difference["methods"].list().at(0)["phases"]["fault"].text(), "6 and 4 values");
  EXPECT_EQ(difference["methods"].list().at(0)["judge_pressure"]["fault"].text(), "80 and 0 values");
  EXPECT_EQ(texts(difference["methods_in_one_alone"]["a"]), std::vector<std::string>{"paper-2"});
  EXPECT_EQ(texts(difference["fields_in_one_alone"]["a"]), (std::vector<std::string>{"cube", "side"}));
  EXPECT_THAT(
      describe_difference(difference),
      AllOf(ContainsRegex("mesh +faces 48 -> 8 \\(-83 %\\), vertices 35 -> 9"), ContainsRegex("array +channels 6 -> 4"),
            ContainsRegex("target +faces 3 -> 0 \\(-100 %\\), faces in one alone 3 and 0"),
            HasSubstr("judge: edge -> none"), HasSubstr("pressure 48 and 8 values"), HasSubstr("in A alone: paper-2")));
}

TEST(CompareRuns, RoundingIsTold) {
  const auto scale = [](double factor) {
    return [factor](RunData& run) { run.methods[0].metrics.relative_error *= factor; };
  };
  const Value rounded = changed(scale(1.0 + 1e-9));
  EXPECT_EQ(rounded["verdict"].text(), "same_to_rounding");
  EXPECT_NEAR(rounded["largest"]["relative"].number(), 1e-9, 1e-15);  // of numbers of size 1 with rounding 1e-16
  EXPECT_EQ(changed(scale(1.0 + 1e-5))["verdict"].text(), "different");
  RunData single = full_run();
  single.solves[0].precision = "single";
  RunData other = single;
  scale(1.0 + 1e-5)(other);
  EXPECT_EQ(compared(single, other)["verdict"].text(), "same_to_rounding");
  scale(1.0 + 1e-3)(other);
  EXPECT_EQ(compared(single, other)["verdict"].text(), "different");
}

TEST(CompareRuns, ACommonPhaseOfAllDrivesIsRounding) {
  const Value difference = changed([](RunData& run) {
    MethodResult& method = run.methods[0];
    method.solution.phases.array() += 1.0;
    method.pressure *= std::polar(1.0, 1.0);
    method.judge_pressure *= std::polar(1.0, 1.0);
    for (FieldResult& field : run.fields) {
      field.pressure[0].second *= std::polar(1.0, 1.0);
    }
  });
  EXPECT_EQ(difference["verdict"].text(), "same_to_rounding");
  EXPECT_NEAR(difference["methods"].list()[0]["phases"]["turn_rad"].number(), 1.0, kRoundingOfSums);
  EXPECT_NEAR(difference["methods"].list()[0]["pressure"]["as_it_is"].number(), 2.0 * std::sin(0.5), kRoundingOfSums);
}

TEST(CompareRuns, AStatusOrACostIsNotIdentical) {
  const Value status = changed([](RunData& run) { run.methods[0].solution.status = PhaseStatus::kConverged; });
  EXPECT_EQ(status["verdict"].text(), "same_to_rounding");
  EXPECT_THAT(describe_difference(status), HasSubstr("surface: status stalled -> converged"));
  const Value cost = changed([](RunData& run) { run.methods[0].solution.cost_history.pop_back(); });
  EXPECT_EQ(cost["verdict"].text(), "same_to_rounding");
  EXPECT_THAT(describe_difference(cost), HasSubstr("surface: values of the cost 3 -> 2 (-33 %)"));
}

TEST(CompareRuns, AMetricThatIsMissingInOneIsDifferent) {
  const Value difference = changed([](RunData& run) { run.methods[0].metrics.relative_error = kNan; });
  EXPECT_EQ(difference["verdict"].text(), "different");
  EXPECT_EQ(difference["largest_result"]["relative"].number(), kInfinity);
  EXPECT_EQ(difference["largest_result"]["what"].text(), "relative_error of surface");
}

// Where the judge is the solving model, a method's own pressure is the judge's unless there is another.
TEST(CompareRuns, TheJudgesPressureMayBeTheMethodsOwn) {
  const RunData a = self_judged_run();
  RunData b = a;
  b.methods[1].judge_pressure = b.methods[1].pressure;
  RunData c = a;
  c.methods[1].judge_pressure.resize(0);
  EXPECT_EQ(compared(b, c)["verdict"].text(), "identical");
  const Value difference = compared(a, c);
  EXPECT_TRUE(difference["methods"].list()[0]["judge_pressure"].empty());
  EXPECT_FALSE(difference["methods"].list()[1]["judge_pressure"]["identical"].flag());
}

TEST(CompareRuns, CausesComeInTheOrderOfLikelihood) {
  RunData a = full_run();
  RunData b = full_run();
  a.methods[0].metrics.relative_error = 0.5;
  EXPECT_THAT(texts(compared(a, b)["causes"]), ElementsAre(StartsWith("nothing that is recorded")));
  b.provenance.machine = "another";
  b.provenance.threads = 1;
  b.solves[0].solver = "LU";
  b.provenance.flags = "-O0";
  b.provenance.revision = "ba9876543210";
  b.complete = false;
  const std::vector<TextChange> scene = {
      {"name", "a", "b"},           {"write[1]", "vtp", "vti"}, {"solve.iterations", "30", "40"},
      {"array.at_mm[2]", "0", "5"}, {"judge", "same", "none"},  {"body.edge_mm", "2", "3"}};
  EXPECT_THAT(texts(compare_runs(a, b, {scene, {}})["causes"]),
              ElementsAre("B is not complete", "the scene: solve.iterations, array.at_mm[2], judge and 1 more",
                          "the program: 0123456789ab -> ba9876543210", "the build: -O3 -> -O0",
                          "the solver of pressure: GMRES, matrix-free, single refined -> LU, single refined",
                          "threads: 2 -> 1", "the machine: host, processor, 2 logical cores -> another"));
  // Names and files change no number.
  EXPECT_THAT(texts(compare_runs(a, full_run(), {{scene[0], scene[1]}, {}})["causes"]),
              ElementsAre(StartsWith("nothing that")));
}

TEST(CompareRuns, SourcesThatWereNotCommittedAreACause) {
  RunData a = full_run();
  a.provenance.revision = "0123-dirty";
  RunData b = a;
  b.methods[0].metrics.relative_error = 0.5;
  b.provenance.threads = 1;
  EXPECT_THAT(texts(compared(a, b)["causes"]),
              ElementsAre("threads: 2 -> 1", HasSubstr("0123-dirty may be two programs")));
}

TEST(CompareRuns, FilesThatASceneNamesAreACause) {
  RunData a = full_run();
  a.scene = "body:\n  mesh:\n    file: hand.stl\n";
  RunData b = a;
  b.methods[0].metrics.relative_error = 0.5;
  EXPECT_THAT(texts(compared(a, b)["causes"]), ElementsAre(StartsWith("nothing that")));  // the mesh is the same
  b.mesh = transformed(b.mesh, Eigen::Matrix3d::Identity(), Vector3(0, 0, 1e-3));
  EXPECT_THAT(texts(compared(a, b)["causes"]), ElementsAre(HasSubstr("a mesh or a table")));
  a.scene = b.scene = "solve:\n  start:\n    previous: old/run.h5\n";
  EXPECT_THAT(texts(compared(a, b)["causes"]), ElementsAre(HasSubstr("phases that the scene reads")));
}

TEST(CompareRuns, FiguresOfAPartAndOfTheWholeAreNotComparable) {
  const Value difference = changed([](RunData& run) { run.judged_skin = SkinExtent::kPart; });
  EXPECT_EQ(difference["verdict"].text(), "different");
  EXPECT_EQ(difference["largest"]["what"].text(), "the skin that is evaluated");
  EXPECT_THAT(describe_difference(difference), HasSubstr("skin      A evaluates the whole skin, B the part within "
                                                         "keep_within_mm: their metrics are not comparable\n"));
  EXPECT_THAT(describe_difference(changed([](RunData&) {})), Not(HasSubstr("evaluates")));
}

TEST(CompareRuns, WarningsAreComparedByName) {
  const Value difference = changed([](RunData& run) {
    run.warnings = {"coarse mesh", "ill_conditioned: about 1e9"};
    run.notes = {"nonlinear: 0.4", "beyond: at 40 mm"};
  });
  EXPECT_THAT(texts(difference["warnings_in_one_alone"]["a"]), ElementsAre("two, with \"quotes\""));
  EXPECT_THAT(texts(difference["warnings_in_one_alone"]["b"]), ElementsAre("ill_conditioned"));
  EXPECT_THAT(texts(difference["notes_in_one_alone"]["a"]), IsEmpty());
  EXPECT_THAT(texts(difference["notes_in_one_alone"]["b"]), ElementsAre("nonlinear"));
  EXPECT_EQ(difference["verdict"].text(), "identical");
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
       {"command line\n  a          touchfield run scene.yaml\n  b          touchfield run scene.yaml -o",
        "array.at_mm[2]: 0 -> 5\n",
        "A lacks 2 keys that B has at their defaults: solve.methods[0].paper.faces, array.level\n",
        "B lacks 1 key that A has at its default: judge.whole\n", "solve.quiet_weight: (absent) -> 2\n",
        "body.long: xxxxx", "... -> (empty)\n",
        "faces 48, vertices 35, largest distance 5.099 mm, relative 0.07071, motion: shift (1, 0, 5) mm\n",
        "the same: 6 channels\n", "the same: 3 faces\n", "mesh: the same: 80 faces\n",
        "metrics of surface\nwidth     5.25 mm -> 10.5 mm (+100 %)\n",
        "different: up to 0.5 relative, width_mm of surface\n",
        "cause     the scene: array.at_mm[2], solve.quiet_weight, body.long\n"}) {
    EXPECT_THAT(text, HasSubstr(part));
  }
  EXPECT_THAT(text, Not(HasSubstr("nan")));
}

TEST(DescribeDifference, SharesChangeByPoints) {
  RunData a = full_run();
  a.methods[0].metrics.relative_error = 0.461;
  RunData b = a;
  b.methods[0].metrics.relative_error = 0.473;
  b.methods[0].metrics.width_mm *= 0.96;
  EXPECT_THAT(describe_difference(compared(a, b)),
              HasSubstr("relative error 46.1 % -> 47.3 % (+1.2 points)\nwidth          5.25 mm -> 5.04 mm (-4 %)\n"));
}

TEST(DescribeDifference, SaysHowAMeshMoved) {
  const auto text_of = [](const TriangleMesh& other) {
    return describe_difference(changed([&](RunData& run) { run.mesh = other; }));
  };
  const TriangleMesh mesh = full_run().mesh;
  const Eigen::Matrix3d quarter = Eigen::AngleAxisd(std::numbers::pi / 2, Vector3::UnitZ()).toRotationMatrix();
  EXPECT_THAT(text_of(transformed(mesh, quarter, Vector3::Zero())),
              HasSubstr("motion: shift (0, 0, 0) mm, angle 90 deg\n"));
  Points dented = mesh.vertices();
  dented(2, 17) += 0.002;
  EXPECT_THAT(text_of({dented, mesh.triangles()}),
              HasSubstr("largest distance 2 mm, relative 0.02772, motion: shift (0, 0, 0.05714) mm, residual 1."));
}

TEST(DescribeDifference, AThousandKeysDoNotFillTheScreen) {
  std::vector<TextChange> scene(1000, {"array.positions.points_mm[0]", "1", "2"});
  const std::string text = describe_difference(compare_runs(full_run(), full_run(), {scene, {}}));
  EXPECT_LT(std::ranges::count(text, '\n'), 80);
  EXPECT_THAT(text, HasSubstr("and 960 more"));
}

}  // namespace
}  // namespace touchfield
