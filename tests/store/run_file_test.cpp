#include "sim/store/run_file.h"

#include <chrono>
#include <csignal>
#include <sys/resource.h>
#include <sys/stat.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "sim/core/errors.h"
#include "sim/store/hdf5_content.h"
#include "tests/support/error_support.h"
#include "tests/support/output_support.h"
#include "tests/support/same_support.h"

namespace touchfield {
namespace {

using support::bare_run;
using support::expect_same;
using support::expect_same_bits;
using support::full_run;
using support::message_of;
using support::read_bytes;
using support::RunData;
using support::sheet;
using support::TemporaryDirectory;
using support::write_bytes;
using ::testing::AllOf;
using ::testing::HasSubstr;

void expect_same(const MethodResult& a, const MethodResult& b) {
  EXPECT_EQ(a.name, b.name);
  EXPECT_EQ(a.method, b.method);
  EXPECT_EQ(a.scheme, b.scheme);
  EXPECT_EQ(a.seconds, b.seconds);
  expect_same(a.solution, b.solution);
  expect_same_bits(a.pressure, b.pressure);
  expect_same_bits(a.judge_pressure, b.judge_pressure);
  expect_same_bits(a.shock_distance_share, b.shock_distance_share);
  expect_same(a.metrics, b.metrics);
}

void expect_same(const FieldResult& a, const FieldResult& b) {
  EXPECT_EQ(a.grid.name, b.grid.name);
  EXPECT_EQ(a.grid.count, b.grid.count);
  EXPECT_EQ(a.grid.origin, b.grid.origin);
  EXPECT_EQ(a.grid.spacing, b.grid.spacing);
  EXPECT_EQ(a.inside, b.inside);
  ASSERT_EQ(a.pressure.size(), b.pressure.size());
  for (std::size_t i = 0; i < a.pressure.size(); ++i) {
    EXPECT_EQ(a.pressure[i].first, b.pressure[i].first);
    expect_same_bits(a.pressure[i].second, b.pressure[i].second);
  }
}

void expect_same(const std::optional<Target>& a, const std::optional<Target>& b) {
  ASSERT_EQ(a.has_value(), b.has_value());
  if (a) {
    EXPECT_EQ(a->faces, b->faces);
    EXPECT_EQ(a->box, b->box);
    expect_same_bits(a->amplitudes, b->amplitudes);
    ASSERT_EQ(a->boxes.size(), b->boxes.size());
    for (std::size_t i = 0; i < a->boxes.size(); ++i) {
      EXPECT_EQ(a->boxes[i].centre, b->boxes[i].centre);
      EXPECT_EQ(a->boxes[i].size, b->boxes[i].size);
      EXPECT_EQ(a->boxes[i].rotation, b->boxes[i].rotation);
    }
  }
}

void expect_same(const SolveRecord& a, const SolveRecord& b) {
  EXPECT_EQ(a.stage, b.stage);
  EXPECT_EQ(a.scheme, b.scheme);
  EXPECT_EQ(a.solver, b.solver);
  EXPECT_EQ(a.precision, b.precision);
  EXPECT_EQ(a.unknowns, b.unknowns);
  EXPECT_EQ(a.right_hand_sides, b.right_hand_sides);
  EXPECT_EQ(a.steps, b.steps);
  EXPECT_EQ(a.refinements, b.refinements);
  expect_same_bits(a.residual, b.residual);
  EXPECT_EQ(a.converged, b.converged);
  expect_same_bits(a.seconds, b.seconds);
}

void expect_same(const RunTransfer& a, const RunTransfer& b) {
  EXPECT_EQ(a.scheme, b.scheme);
  EXPECT_EQ(a.problem.target, b.problem.target);
  EXPECT_EQ(a.problem.amplitudes, b.problem.amplitudes);
  EXPECT_EQ(a.problem.weights, b.problem.weights);
  EXPECT_EQ(a.problem.quiet, b.problem.quiet);
  EXPECT_EQ(a.incident, b.incident);
  expect_same_bits(a.quiet_weight, b.quiet_weight);
  expect_same_bits(a.channels_left_out, b.channels_left_out);
  expect_same_bits(a.quiet_left_out, b.quiet_left_out);
}

void expect_same(const Run& a, const Run& b) {
  EXPECT_EQ(a.name, b.name);
  EXPECT_EQ(a.scene, b.scene);
  EXPECT_EQ(a.judge, b.judge);
  EXPECT_EQ(a.complete, b.complete);
  EXPECT_EQ(a.seconds, b.seconds);
  EXPECT_EQ(a.alarms, b.alarms);
  EXPECT_EQ(a.warnings, b.warnings);
  EXPECT_EQ(a.notes, b.notes);
  EXPECT_EQ(a.solved_skin, b.solved_skin);
  EXPECT_EQ(a.judged_skin, b.judged_skin);
  expect_same(a.provenance, b.provenance);
  expect_same(a.mesh, b.mesh);
  expect_same(a.array, b.array);
  expect_same(a.target, b.target);
  ASSERT_EQ(a.judge_model.has_value(), b.judge_model.has_value());
  if (a.judge_model) {
    EXPECT_EQ(a.judge_model->scheme, b.judge_model->scheme);
    expect_same(a.judge_model->mesh, b.judge_model->mesh);
    expect_same(a.judge_model->target, b.judge_model->target);
  }
  expect_same_bits(a.alarm, b.alarm);
  ASSERT_EQ(a.solves.size(), b.solves.size());
  for (std::size_t i = 0; i < a.solves.size(); ++i) {
    expect_same(a.solves[i], b.solves[i]);
  }
  ASSERT_EQ(a.transfers.size(), b.transfers.size());
  for (std::size_t i = 0; i < a.transfers.size(); ++i) {
    expect_same(a.transfers[i], b.transfers[i]);
  }
  ASSERT_EQ(a.methods.size(), b.methods.size());
  for (std::size_t i = 0; i < a.methods.size(); ++i) {
    expect_same(a.methods[i], b.methods[i]);
  }
  ASSERT_EQ(a.fields.size(), b.fields.size());
  for (std::size_t i = 0; i < a.fields.size(); ++i) {
    expect_same(a.fields[i], b.fields[i]);
  }
}

TEST(RunFile, ReadsBackWhatWasWritten) {
  const TemporaryDirectory directory("with space \xc3\xa4");
  const std::string path = directory.file("run.h5");
  const RunData run = full_run();
  write_run_file(path, run);
  expect_same(run, read_run_file(path));
  EXPECT_EQ(directory.entries(), 1U);  // no temporary file is left
}

TEST(RunFile, ARunOfNothingButAMeshAndAnArray) {
  const TemporaryDirectory directory;
  const std::string path = directory.file("run.h5");
  const RunData run = bare_run(sheet(1, 1, 0.01));
  write_run_file(path, run);
  expect_same(run, read_run_file(path));
  const hdf5::Content content = hdf5::read_content(path);
  for (const char* absent :
       {"target", "methods", "judge", "transfer", "solves", "field", "seconds", "alarms", "warnings", "notes"}) {
    EXPECT_FALSE(content.has(absent)) << absent;
  }
}

TEST(RunFile, ATransferMatrixWithoutQuietRows) {
  const TemporaryDirectory directory;
  const std::string path = directory.file("run.h5");
  RunData run = full_run();
  run.transfers.push_back(run.transfers[0]);
  run.transfers[0].problem.quiet.resize(0, run.array.size());
  run.transfers[1].scheme = "chief";
  write_run_file(path, run);
  expect_same(run, read_run_file(path));
}

TEST(RunFile, APlaneWaveAndAMethodWithoutPressure) {
  const TemporaryDirectory directory;
  const std::string path = directory.file("run.h5");
  RunData run = bare_run(sheet(1, 1, 0.01));
  run.array = plane_wave(Vector3::UnitZ(), 1.5);
  run.methods.push_back(support::made_up_method("fixed", run, 0.5));
  run.methods[0].pressure.resize(0);
  run.judge = "same";
  write_run_file(path, run);
  expect_same(run, read_run_file(path));
}

TEST(RunFile, AJudgeWithFacesInFourOfARunWithoutTarget) {
  const TemporaryDirectory directory;
  const std::string path = directory.file("run.h5");
  RunData run = bare_run(sheet(1, 1, 0.01));
  run.judge = "split";
  run.judge_model = JudgeModel{.scheme = "chief", .mesh = sheet(2, 2, 0.005), .target = std::nullopt};
  run.methods.push_back(support::made_up_method("judged", run, 0.5));
  run.methods.push_back(support::made_up_method("not_yet", run, 1.5));
  run.methods[0].judge_pressure = support::made_up_pressure(8, 2.5);
  write_run_file(path, run);
  expect_same(run, read_run_file(path));
}

// The file keeps k b of a piston; the directivity made from it must be the same one. 1e-12: k b is recovered from the
// slope of a curve whose values are good to about 1e-15, at an angle where that costs two digits.
TEST(RunFile, APistonKeepsItsRadius) {
  const TemporaryDirectory directory;
  const std::string path = directory.file("run.h5");
  for (const double radius : {0.5e-3, 4.5e-3, 60e-3}) {
    RunData run = bare_run(sheet(1, 1, 0.01));
    run.array = make_array(grid_layout(2, 1, 0.01), Directivity::piston(732.28, radius), 1.0, 4.0);
    write_run_file(path, run);
    const RunData back = read_run_file(path);
    for (const double theta : {0.1, 0.7, 1.4}) {
      EXPECT_NEAR(back.array.directivity.at(theta).value, run.array.directivity.at(theta).value, 1e-12);
    }
  }
}

TEST(RunFile, TheSameRunGivesTheSameBytes) {
  const TemporaryDirectory directory;
  write_run_file(directory.file("a.h5"), full_run());
  write_run_file(directory.file("b.h5"), full_run());
  EXPECT_EQ(read_bytes(directory.file("a.h5")), read_bytes(directory.file("b.h5")));
}

TEST(RunFile, AnOlderFileIsReplaced) {
  const TemporaryDirectory directory;
  const std::string path = directory.file("run.h5");
  write_run_file(path, bare_run(sheet(1, 1, 0.01)));
  write_run_file(path, full_run());
  expect_same(full_run(), read_run_file(path));
}

TEST(RunFile, TheGroupsOfAJudgeThatIsTheSolvingModelLeadToIt) {
  const TemporaryDirectory directory;
  const std::string path = directory.file("run.h5");
  const RunData run = support::self_judged_run();
  write_run_file(path, run);
  expect_same(run, read_run_file(path));
  const hdf5::Content content = hdf5::read_content(path);
  const hdf5::Content judge = content.open("judge");
  EXPECT_EQ(judge.text_attribute("judge"), "same");
  EXPECT_EQ(judge.open("mesh").shape("triangles"), (hdf5::Shape{48, 3}));
  EXPECT_EQ(judge.open("target").shape("face"), (hdf5::Shape{3}));
  Eigen::VectorXcd pressure(48);
  judge.open("methods").open("surface").read("pressure", {48}, pressure.data());
  EXPECT_EQ(pressure, run.methods[0].pressure);
  judge.open("methods").open("paper-2").read("pressure", {48}, pressure.data());
  EXPECT_EQ(pressure, run.methods[1].judge_pressure);
}

TEST(RunFile, PartsThatDoNotFitAreRefusedBeforeAnythingIsWritten) {
  const TemporaryDirectory directory;
  const std::string path = directory.file("run.h5");
  const auto refused = [&](auto&& change) {
    RunData run = full_run();
    change(run);
    return message_of<InputError>([&] { write_run_file(path, run); });
  };
  EXPECT_THAT(refused([](RunData& run) { run.methods[1].pressure.conservativeResize(47); }),
              AllOf(HasSubstr("paper-2"), HasSubstr("47"), HasSubstr("48")));
  EXPECT_THAT(refused([](RunData& run) { run.methods[0].solution.phases.conservativeResize(5); }), HasSubstr("phases"));
  EXPECT_THAT(refused([](RunData& run) { run.methods[0].name = "paper-2"; }), HasSubstr("twice"));
  EXPECT_THAT(refused([](RunData& run) { run.methods[0].name = "a/b"; }), HasSubstr("a/b"));
  EXPECT_THAT(refused([](RunData& run) { run.methods[0].seconds[0].second = 0.5; }), HasSubstr("seconds_solve"));
  EXPECT_THAT(refused([](RunData& run) { run.methods[0].seconds[1].first = "solve"; }), HasSubstr("solve"));
  EXPECT_THAT(refused([](RunData& run) { run.target->faces[2] = 48; }), HasSubstr("48"));
  EXPECT_THAT(refused([](RunData& run) { run.target->box.pop_back(); }), HasSubstr("box"));
  EXPECT_THAT(refused([](RunData& run) { run.fields[0].inside.pop_back(); }), HasSubstr("inside"));
  EXPECT_THAT(refused([](RunData& run) { run.fields[1].pressure[0].first = "other"; }), HasSubstr("other"));
  EXPECT_THAT(refused([](RunData& run) { run.judge = "nobody"; }), HasSubstr("nobody"));
  EXPECT_THAT(refused([](RunData& run) { run.judge = "same"; }), HasSubstr("must not have a model"));
  EXPECT_THAT(refused([](RunData& run) { run.judge_model.reset(); }), HasSubstr("must have a model"));
  EXPECT_THAT(refused([](RunData& run) { run.judge_model->target->faces[3] = 80; }),
              AllOf(HasSubstr("judge's target"), HasSubstr("80")));
  EXPECT_THAT(refused([](RunData& run) { run.methods[1].judge_pressure.conservativeResize(48); }),
              AllOf(HasSubstr("paper-2"), HasSubstr("judge's pressure"), HasSubstr("80")));
  EXPECT_THAT(refused([](RunData& run) {
                run.judge = "none";
                run.judge_model.reset();
              }),
              HasSubstr("judge's pressure"));
  EXPECT_THAT(refused([](RunData& run) { run.array.device.conservativeResize(2); }), HasSubstr("device"));
  EXPECT_THAT(refused([](RunData& run) { run.transfers.push_back(run.transfers[0]); }), HasSubstr("twice"));
  EXPECT_THAT(refused([](RunData& run) { run.transfers[0].problem.weights.conservativeResize(2); }),
              AllOf(HasSubstr("transfer burton_miller"), HasSubstr("weights")));
  EXPECT_THAT(refused([](RunData& run) { run.transfers[0].incident.conservativeResize(2, 6); }),
              AllOf(HasSubstr("a column of incident"), HasSubstr("must have 3")));
  EXPECT_THAT(refused([](RunData& run) { run.transfers[0].problem.quiet.conservativeResize(2, 5); }),
              AllOf(HasSubstr("a row of quiet"), HasSubstr("must have 6")));
  EXPECT_THAT(refused([](RunData& run) { run.target.reset(); }), HasSubstr("transfer burton_miller"));
  EXPECT_EQ(directory.entries(), 0U);
}

TEST(RunFile, AFailureNamesThePathAndTheReasonAndLeavesNothing) {
  const TemporaryDirectory directory;
  const RunData run = bare_run(sheet(1, 1, 0.01));
  const std::string missing = directory.file("missing/run.h5");
  EXPECT_THAT(message_of<IoError>([&] { write_run_file(missing, run); }),
              AllOf(HasSubstr(missing), HasSubstr("No such file or directory")));
  write_bytes(directory.file("plain"), "x");
  EXPECT_THAT(message_of<IoError>([&] { write_run_file(directory.file("plain/run.h5"), run); }),
              HasSubstr("Not a directory"));
  std::filesystem::create_directory(directory.file("taken"));
  EXPECT_THAT(message_of<IoError>([&] { write_run_file(directory.file("taken"), run); }), HasSubstr("Is a directory"));
  EXPECT_EQ(directory.entries(), 2U);  // "plain" and "taken" alone
}

/// Lets this process write no file beyond a size while it lives, as a full disk would.
class FileSizeLimit {
 public:
  explicit FileSizeLimit(rlim_t bytes) : handler_(std::signal(SIGXFSZ, SIG_IGN)) {
    getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit limit{bytes, before_.rlim_max};
    setrlimit(RLIMIT_FSIZE, &limit);
  }
  FileSizeLimit(const FileSizeLimit&) = delete;
  FileSizeLimit& operator=(const FileSizeLimit&) = delete;
  ~FileSizeLimit() {
    setrlimit(RLIMIT_FSIZE, &before_);
    std::signal(SIGXFSZ, handler_);
  }

 private:
  rlimit before_{};
  void (*handler_)(int);
};

TEST(RunFile, AFullDiskKeepsTheOlderFile) {
  const TemporaryDirectory directory;
  const std::string path = directory.file("run.h5");
  const RunData older = bare_run(sheet(1, 1, 0.01));
  write_run_file(path, older);
  {
    const FileSizeLimit limit(2000);
    EXPECT_THAT(message_of<IoError>([&] { write_run_file(path, full_run()); }),
                AllOf(HasSubstr(path), HasSubstr("File too large")));
    EXPECT_THAT(message_of<IoError>([&] { write_text_file(directory.file("log"), std::string(3000, 'x')); }),
                HasSubstr("File too large"));
  }
  EXPECT_EQ(directory.entries(), 1U);
  expect_same(older, read_run_file(path));
}

TEST(RunFile, LargeDatasetsAreCompressedAndReadBack) {
  const TemporaryDirectory directory;
  const std::string path = directory.file("run.h5");
  RunData run = bare_run(sheet(160, 140, 0.001));  // 44,800 faces
  run.methods.push_back(support::made_up_method("surface", run, 0.5));
  run.methods[0].pressure.setConstant({1.0, 2.0});
  write_run_file(path, run);
  const auto raw = static_cast<std::size_t>(run.mesh.face_count()) * sizeof(Complex);
  EXPECT_LT(read_bytes(path).size(), raw + 22'681 * 24 + 44'800 * 20);  // less than the numbers alone
  expect_same(run, read_run_file(path));
}

TEST(RunFile, ARunOfTheUsualSizeTakesLittleTime) {
  const TemporaryDirectory directory;
  const std::string path = directory.file("run.h5");
  RunData run = bare_run(sheet(100, 60, 0.001));  // 12,000 faces
  run.array = make_array(grid_layout(44, 34, 0.01016), Directivity::t4010a1(), 1.0, 4.0);
  for (const char* name : {"a", "b", "c", "d"}) {
    run.methods.push_back(support::made_up_method(name, run, 0.5));
  }
  FieldResult field;
  field.grid = {"cube", Vector3::Zero(), Vector3::Constant(1e-3), {40, 40, 38}};
  field.inside.assign(static_cast<std::size_t>(field.grid.size()), 0);
  for (const char* name : {"a", "b", "c"}) {
    field.pressure.emplace_back(name, support::made_up_pressure(field.grid.size(), 3));
  }
  run.fields.push_back(field);
  const auto start = std::chrono::steady_clock::now();
  write_run_file(path, run);
  const auto written = std::chrono::steady_clock::now();
  expect_same(run, read_run_file(path));
  const std::chrono::duration<double> writing = written - start;
  const std::chrono::duration<double> reading = std::chrono::steady_clock::now() - written;
  // About 0.15 s and 0.03 s where this was written; the bound leaves room for sanitizers and a busy machine.
  EXPECT_LT(writing.count(), 5.0);
  EXPECT_LT(reading.count(), 5.0);
}

}  // namespace
}  // namespace touchfield
