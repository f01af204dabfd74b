
#include "sim/run/hdf5_file.h"
#include "sim/run/run_compare.h"
#include "sim/run/run_file.h"
#include "sim/run/run_text.h"
#include "tests/support/output_support.h"
#include "tests/support/testing.h"

namespace touchfield::array_truth_file_test {

ChannelResponse some_response(Eigen::Index channels, double first) {
  return {Eigen::VectorXd::LinSpaced(channels, first, 1.0), Eigen::VectorXd::LinSpaced(channels, -1.0, 1.0)};
}

TEST(RunFileArray, KeepsWhatTheSolverReckonsWithAndTheTruth) {
  const TemporaryDirectory directory;
  RunData run = full_run();
  run.array.response = some_response(run.array.size(), 0.0);
  run.array_truth = {some_response(run.array.size(), 0.5), 256};
  write_run_file(directory.file("run.h5"), run);
  const RunData back = read_run_file(directory.file("run.h5"));
  EXPECT_EQ(back.array.response.gain, run.array.response.gain);
  EXPECT_EQ(back.array.response.phase, run.array.response.phase);
  ASSERT_TRUE(back.array_truth.has_value());
  EXPECT_EQ(back.array_truth->response.gain, run.array_truth->response.gain);
  EXPECT_EQ(back.array_truth->response.phase, run.array_truth->response.phase);
  EXPECT_EQ(back.array_truth->phase_levels, 256);
  const hdf5::Content array = hdf5::read_content(directory.file("run.h5")).open("array");
  EXPECT_TRUE(array.has("gain"));
  EXPECT_TRUE(array.open("truth").has("phase"));
}

TEST(RunFileArray, AsDesignedHasNoResponse) {
  const TemporaryDirectory directory;
  RunData run = full_run();
  run.array_truth = {{}, 16};  // rounded phases alone
  write_run_file(directory.file("run.h5"), run);
  const RunData back = read_run_file(directory.file("run.h5"));
  EXPECT_TRUE(back.array.response.as_designed());
  EXPECT_TRUE(back.array_truth->response.as_designed());
  run.array_truth.reset();
  write_run_file(directory.file("run.h5"), run);
  EXPECT_FALSE(read_run_file(directory.file("run.h5")).array_truth.has_value());
}

TEST(RunFileArray, ResponsesMustFitTheChannels) {
  const TemporaryDirectory directory;
  const auto refused = [&](const RunData& run) {
    return message_of<InputError>([&] { write_run_file(directory.file("run.h5"), run); });
  };
  RunData run = full_run();
  run.array.response = some_response(run.array.size() - 1, 0.0);
  EXPECT_THAT(refused(run), HasSubstr("array: gain has"));
  run.array.response = {};
  run.array_truth = {some_response(run.array.size(), 0.0), 0};
  run.array_truth->response.phase.resize(1);
  EXPECT_THAT(refused(run), HasSubstr("array's truth: phase has 1 values"));
  run.array_truth = {{}, -1};
  EXPECT_THAT(refused(run), HasSubstr("phase_levels = -1"));
}

TEST(RunFileArray, RunsOfOtherResponsesAreOfOtherArrays) {
  const RunData a = full_run();
  RunData b = a;
  b.array.response = some_response(b.array.size(), 0.9);
  EXPECT_EQ(compare_runs(a, b, {}).largest.what, "the array");
  b.array.response = {};
  b.array_truth = {some_response(b.array.size(), 0.9), 0};
  EXPECT_EQ(compare_runs(a, b, {}).largest.what, "the array");
  EXPECT_EQ(compare_runs(b, b, {}).verdict(), "identical");
}

TEST(RunText, SaysHowChannelsDifferFromTheirDesign) {
  RunData run = full_run();
  EXPECT_THAT(describe_run(run), Not(HasSubstr("true response")));
  const Eigen::Index channels = run.array.size();
  run.array_truth = {{Eigen::VectorXd::Constant(channels, 0.9), Eigen::VectorXd::Constant(channels, 0.1)}, 16};
  run.array_truth->response.gain(0) = 0;
  const std::string text = describe_run(run);
  EXPECT_THAT(text, ContainsRegex("\nresponse +as designed\n"));
  EXPECT_THAT(text, ContainsRegex("\ntrue response +gain 0.900 .- 0.000, phase 5.73 deg rms, 1 of [0-9]+ dead\n"));
  EXPECT_THAT(text, ContainsRegex("\ntrue phase levels +16\n"));
}

}  // namespace touchfield::array_truth_file_test
