#include "sim/run/run_file.h"

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

TEST_F(RunFile, ResponsesThatTheSolverAssumesAndTrueOnes) {
  RunData run = full_run();
  run.array.response = made_up_response(run.array.size(), 0.0);
  run.array_truth = {made_up_response(run.array.size(), 0.5), 256};
  expect_kept(run);
  run.array.response = {};
  run.array_truth = {{}, 16};  // rounded phases alone
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
  const std::vector<std::pair<std::string, std::function<void(RunData&)>>> cases = {
      {"paper-2: pressure has 47 values, must have 48",
       [](auto& run) { run.methods[1].pressure.conservativeResize(47); }},
      {"twice", [](auto& run) { run.methods[0].name = "paper-2"; }},
      {"a/b", [](auto& run) { run.methods[0].name = "a/b"; }},
      {"48", [](auto& run) { run.target->faces[2] = 48; }},
      {"must have a model", [](auto& run) { run.evaluation_model.reset(); }},
      {"evaluation's pressure", [](auto& run) { run.methods[1].evaluation_pressure.conservativeResize(48); }},
      {"device", [](auto& run) { run.array.device.conservativeResize(2); }},
      {"a column of incident", [](auto& run) { run.transfers[0].incident.conservativeResize(2, 6); }},
      {"array: gain has", [](auto& run) { run.array.response = made_up_response(5, 0.0); }}};
  for (const auto& [phrase, change] : cases) {
    RunData run = full_run();
    change(run);
    EXPECT_THAT(message_of<InputError>([&] { write_run_file(path_, run); }), HasSubstr(phrase));
  }
  EXPECT_EQ(directory_.entries(), 0U);
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

}  // namespace touchfield::run_file_test
