#include "sim/run/run_file.h"

#include <chrono>
#include <csignal>
#include <sys/resource.h>
#include <sys/stat.h>

#include "sim/run/hdf5_file.h"
#include "sim/run/text_table.h"
#include "tests/support/output_support.h"
#include "tests/support/result_file_support.h"
#include "tests/support/same_support.h"
#include "tests/support/testing.h"

namespace touchfield::run_file_test {

class RunFile : public ResultFile {
 protected:
  void expect_kept(const RunData& run) const {
    write_run_file(path_, run);
    expect_same(run, read_run_file(path_));
    EXPECT_EQ(directory_.entries(), 1U);  // no temporary file is left
  }
};

TEST_F(RunFile, ReadsBackWhatWasWrittenInPlaceOfAnOlderFile) {
  expect_kept(bare_run(sheet(1, 1, 0.01)));
  const hdf5::Content content = hdf5::read_content(path_);
  for (const char* absent : {"target", "methods", "evaluation", "transfer", "solves", "field", "seconds",
                             "resonance_checks", "warnings", "notes"}) {
    EXPECT_FALSE(content.has(absent)) << absent;
  }
  expect_kept(full_run());
  const std::string bytes = read_bytes(path_);
  expect_kept(full_run());
  EXPECT_EQ(read_bytes(path_), bytes);
}

TEST_F(RunFile, ATransferMatrixWithoutOutsideRows) {
  RunData run = full_run();
  run.transfers.push_back(run.transfers[0]);
  run.transfers[0].problem.outside.resize(0, run.array.size());
  run.transfers[1].scheme = "chief";
  expect_kept(run);
}

TEST_F(RunFile, APlaneWaveAndAMethodWithoutPressure) {
  RunData run = bare_run(sheet(1, 1, 0.01));
  run.array = plane_wave(Vector3::UnitZ(), 1.5);
  run.methods.push_back(made_up_method("fixed", run, 0.5));
  run.methods[0].pressure.resize(0);
  run.evaluation = "same";
  expect_kept(run);
}

TEST_F(RunFile, AnEvaluationWithFacesInFourOfARunWithoutTarget) {
  RunData run = bare_run(sheet(1, 1, 0.01));
  run.evaluation = "split";
  run.evaluation_model = EvaluationModel{.scheme = "chief", .mesh = sheet(2, 2, 0.005), .target = std::nullopt};
  run.methods.push_back(made_up_method("evaluated", run, 0.5));
  run.methods.push_back(made_up_method("not_yet", run, 1.5));
  run.methods[0].evaluation_pressure = made_up_pressure(8, 2.5);
  expect_kept(run);
}

// The file keeps k b of a piston; the directivity made from it must be the same one. 1e-12: k b is recovered from the
// slope of a curve whose values are good to about 1e-15, at an angle where that costs two digits.
TEST_F(RunFile, APistonKeepsItsRadius) {
  for (const double radius : {0.5e-3, 4.5e-3, 60e-3}) {
    RunData run = bare_run(sheet(1, 1, 0.01));
    run.array = make_array(grid_layout(2, 1, 0.01), Directivity::piston(732.28, radius), 1.0, 4.0);
    write_run_file(path_, run);
    const RunData back = read_run_file(path_);
    for (const double theta : {0.1, 0.7, 1.4}) {
      EXPECT_NEAR(back.array.directivity.at(theta).value, run.array.directivity.at(theta).value, 1e-12);
    }
  }
}

TEST_F(RunFile, TheGroupsOfAnEvaluationThatIsTheSolvingModelLeadToIt) {
  const RunData run = self_evaluated_run();
  expect_kept(run);
  const hdf5::Content content = hdf5::read_content(path_);
  const hdf5::Content evaluation = content.open("evaluation");
  EXPECT_EQ(evaluation.text_attribute("evaluation"), "same");
  EXPECT_EQ(evaluation.open("mesh").shape("triangles"), (hdf5::Shape{48, 3}));
  EXPECT_EQ(evaluation.open("target").shape("face"), (hdf5::Shape{3}));
  Eigen::VectorXcd pressure(48);
  evaluation.open("methods").open("surface").read("pressure", {48}, pressure.data());
  EXPECT_EQ(pressure, run.methods[0].pressure);
  evaluation.open("methods").open("paper-2").read("pressure", {48}, pressure.data());
  EXPECT_EQ(pressure, run.methods[1].evaluation_pressure);
}

TEST_F(RunFile, PartsThatDoNotFitAreRefusedBeforeAnythingIsWritten) {
  const auto refused = [&](auto&& change) {
    RunData run = full_run();
    change(run);
    return message_of<InputError>([&] { write_run_file(path_, run); });
  };
  EXPECT_THAT(refused([](RunData& run) { run.methods[1].pressure.conservativeResize(47); }),
              AllOf(HasSubstr("paper-2"), HasSubstr("47"), HasSubstr("48")));
  EXPECT_THAT(refused([](RunData& run) { run.methods[0].radiation.conservativeResize(48); }),
              AllOf(HasSubstr("surface: radiation"), HasSubstr("48"), HasSubstr("80")));
  EXPECT_THAT(refused([](RunData& run) { run.methods[0].solution.phases.conservativeResize(5); }), HasSubstr("phases"));
  EXPECT_THAT(refused([](RunData& run) { run.methods[0].name = "paper-2"; }), HasSubstr("twice"));
  EXPECT_THAT(refused([](RunData& run) { run.methods[0].name = "a/b"; }), HasSubstr("a/b"));
  EXPECT_THAT(refused([](RunData& run) { run.methods[0].seconds[0].second = 0.5; }), HasSubstr("seconds_solve"));
  EXPECT_THAT(refused([](RunData& run) { run.methods[0].seconds[1].first = "solve"; }), HasSubstr("solve"));
  EXPECT_THAT(refused([](RunData& run) { run.target->faces[2] = 48; }), HasSubstr("48"));
  EXPECT_THAT(refused([](RunData& run) { run.target->box.pop_back(); }), HasSubstr("box"));
  EXPECT_THAT(refused([](RunData& run) { run.fields[0].inside.pop_back(); }), HasSubstr("inside"));
  EXPECT_THAT(refused([](RunData& run) { run.fields[1].pressure[0].first = "other"; }), HasSubstr("other"));
  EXPECT_THAT(refused([](RunData& run) { run.evaluation = "nobody"; }), HasSubstr("nobody"));
  EXPECT_THAT(refused([](RunData& run) { run.evaluation = "same"; }), HasSubstr("must not have a model"));
  EXPECT_THAT(refused([](RunData& run) { run.evaluation_model.reset(); }), HasSubstr("must have a model"));
  EXPECT_THAT(refused([](RunData& run) { run.evaluation_model->target->faces[3] = 80; }),
              AllOf(HasSubstr("evaluation's target"), HasSubstr("80")));
  EXPECT_THAT(refused([](RunData& run) { run.methods[1].evaluation_pressure.conservativeResize(48); }),
              AllOf(HasSubstr("paper-2"), HasSubstr("evaluation's pressure"), HasSubstr("80")));
  EXPECT_THAT(refused([](RunData& run) {
                run.evaluation = "none";
                run.evaluation_model.reset();
              }),
              HasSubstr("evaluation's pressure"));
  EXPECT_THAT(refused([](RunData& run) { run.array.device.conservativeResize(2); }), HasSubstr("device"));
  EXPECT_THAT(refused([](RunData& run) { run.transfers.push_back(run.transfers[0]); }), HasSubstr("twice"));
  EXPECT_THAT(refused([](RunData& run) { run.transfers[0].problem.weights.conservativeResize(2); }),
              AllOf(HasSubstr("transfer burton_miller"), HasSubstr("weights")));
  EXPECT_THAT(refused([](RunData& run) { run.transfers[0].incident.conservativeResize(2, 6); }),
              AllOf(HasSubstr("a column of incident"), HasSubstr("must have 3")));
  EXPECT_THAT(refused([](RunData& run) { run.transfers[0].problem.outside.conservativeResize(2, 5); }),
              AllOf(HasSubstr("a row of outside"), HasSubstr("must have 6")));
  EXPECT_THAT(refused([](RunData& run) { run.target.reset(); }), HasSubstr("transfer burton_miller"));
  EXPECT_EQ(directory_.entries(), 0U);
}

TEST_F(RunFile, AFailureNamesThePathAndTheReasonAndLeavesNothing) {
  const RunData run = bare_run(sheet(1, 1, 0.01));
  const std::string missing = directory_.file("missing/run.h5");
  EXPECT_THAT(message_of<IoError>([&] { write_run_file(missing, run); }),
              AllOf(HasSubstr(missing), HasSubstr("No such file or directory")));
  write_bytes(directory_.file("plain"), "x");
  EXPECT_THAT(message_of<IoError>([&] { write_run_file(directory_.file("plain/run.h5"), run); }),
              HasSubstr("Not a directory"));
  std::filesystem::create_directory(directory_.file("taken"));
  EXPECT_THAT(message_of<IoError>([&] { write_run_file(directory_.file("taken"), run); }), HasSubstr("it is a folder"));
  EXPECT_EQ(directory_.entries(), 2U);  // "plain" and "taken" alone
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

TEST_F(RunFile, AFullDiskKeepsTheOlderFile) {
  const RunData older = bare_run(sheet(1, 1, 0.01));
  write_run_file(path_, older);
  {
    const FileSizeLimit limit(2000);
    EXPECT_THAT(message_of<IoError>([&] { write_run_file(path_, full_run()); }),
                AllOf(HasSubstr(path_), HasSubstr("File too large")));
    EXPECT_THAT(message_of<IoError>([&] { write_text_file(directory_.file("log"), std::string(3000, 'x')); }),
                HasSubstr("File too large"));
  }
  EXPECT_EQ(directory_.entries(), 1U);
  expect_same(older, read_run_file(path_));
}

TEST_F(RunFile, LargeDatasetsAreCompressedAndReadBack) {
  RunData run = bare_run(sheet(160, 140, 0.001));  // 44,800 faces
  run.methods.push_back(made_up_method("surface", run, 0.5));
  run.methods[0].pressure.setConstant({1.0, 2.0});
  write_run_file(path_, run);
  const auto raw = static_cast<std::size_t>(run.mesh.face_count()) * sizeof(Complex);
  EXPECT_LT(read_bytes(path_).size(), raw + 22'681 * 24 + 44'800 * 20);  // less than the numbers alone
  expect_same(run, read_run_file(path_));
}

TEST_F(RunFile, ARunOfTheUsualSizeTakesLittleTime) {
  RunData run = bare_run(sheet(100, 60, 0.001));  // 12,000 faces
  run.array = make_array(grid_layout(44, 34, 0.01016), Directivity::t4010a1(), 1.0, 4.0);
  for (const char* name : {"a", "b", "c", "d"}) {
    run.methods.push_back(made_up_method(name, run, 0.5));
  }
  FieldResult field;
  field.grid = {"cube", Vector3::Zero(), Vector3::Constant(1e-3), {40, 40, 38}};
  field.inside.assign(static_cast<std::size_t>(field.grid.size()), 0);
  for (const char* name : {"a", "b", "c"}) {
    field.pressure.emplace_back(name, made_up_pressure(field.grid.size(), 3));
  }
  run.fields.push_back(field);
  const auto start = std::chrono::steady_clock::now();
  write_run_file(path_, run);
  const auto written = std::chrono::steady_clock::now();
  expect_same(run, read_run_file(path_));
  const std::chrono::duration<double> writing = written - start;
  const std::chrono::duration<double> reading = std::chrono::steady_clock::now() - written;
  // About 0.15 s and 0.03 s where this was written; the bound leaves room for sanitizers and a busy machine.
  EXPECT_LT(writing.count(), 5.0);
  EXPECT_LT(reading.count(), 5.0);
}

}  // namespace touchfield::run_file_test
