#include "sim/run/motion_file.h"

#include "sim/run/run_file.h"
#include "tests/support/motion_support.h"
#include "tests/support/output_support.h"
#include "tests/support/result_file_support.h"
#include "tests/support/same_support.h"
#include "tests/support/testing.h"

namespace touchfield::motion_file_test {

class MotionFile : public ResultFile {};
class DamagedMotionFile : public ResultFile {};

TEST_F(MotionFile, ReadsBackWhatWasWritten) {
  write_motion_file(path_, full_motion());
  expect_same(full_motion(), read_motion_file(path_));
  EXPECT_EQ(directory_.entries(), 1U);  // no temporary file is left
  EXPECT_EQ(archive_format(path_), kMotionArchive.name());
}

TEST_F(MotionFile, AMotionThatHasOnlyBegun) {
  Motion motion{.name = "bare", .scene = "", .array = full_motion().array, .mesh = sheet(1, 1, 0.01)};
  write_motion_file(path_, motion);
  expect_same(motion, read_motion_file(path_));
  motion.methods.push_back({.name = "surface", .method = "surface", .scheme = "chief"});  // no frame, no score
  write_motion_file(path_, motion);
  expect_same(motion, read_motion_file(path_));
  const hdf5::Content content = hdf5::read_content(path_);
  for (const char* absent : {"evaluation", "seconds", "warnings", "notes", "instants"}) {
    EXPECT_FALSE(content.has(absent)) << absent;
  }
}

TEST_F(MotionFile, SinglePrecisionAndAStillSkinTakeLessRoom) {
  Motion motion = full_motion();
  for (MotionInstant& instant : motion.instants) {
    instant.mesh = *motion.evaluation;
    instant.pressure[0].second = instant.pressure[0].second.cast<std::complex<float>>().cast<Complex>();
  }
  write_motion_file(path_, motion);
  expect_same(motion, read_motion_file(path_));
  const hdf5::Content instants = hdf5::read_content(path_).open("instants");
  EXPECT_EQ(instants.shape("vertices").front(), 1U);
  EXPECT_EQ(instants.shape("sensed").front(), 3U);
}

TEST_F(MotionFile, PartsThatDoNotFitAreRefusedBeforeAnythingIsWritten) {
  const std::vector<std::pair<std::string, std::function<void(Motion&)>>> cases = {
      {"method paper-2: frame 2: phases has 5 values, must have 6",
       [](Motion& m) { m.methods[1].frames[2].solution.phases.conservativeResize(5); }},
      {"twice", [](Motion& m) { m.methods[0].name = "paper-2"; }},
      {"-1..3", [](Motion& m) { m.methods[0].scores[5].frame = 4; }},
      {"evaluation mesh", [](Motion& m) { m.instants[1].mesh = sheet(1, 1, 0.01); }},
      {"solving mesh", [](Motion& m) { m.instants[0].sensed = sheet(1, 1, 0.01); }},
      {"pressure", [](Motion& m) { m.instants[0].pressure[0].second.resize(0); }},
      {"patch: radiation", [](Motion& m) { m.patch->radiation.conservativeResize(2, 4); }},
      {"index_pad", [](Motion& m) { m.methods[1].watched[0].second.conservativeResize(5); }}};
  for (const auto& [phrase, change] : cases) {
    Motion motion = full_motion();
    change(motion);
    EXPECT_THAT(message_of<InputError>([&] { write_motion_file(path_, motion); }), HasSubstr(phrase));
  }
  EXPECT_EQ(directory_.entries(), 0U);
}

TEST_F(DamagedMotionFile, RunsAndNewerMotionsAreInputErrors) {
  const auto read = [&] { read_motion_file(path_); };
  write_run_file(path_, full_run());
  EXPECT_THAT(message_of<InputError>(read), HasSubstr("not a touchfield motion"));
  write_motion_file(path_, full_motion());
  EXPECT_THAT(message_of<InputError>([&] { read_run_file(path_); }), HasSubstr("not a touchfield run"));
  const hdf5::MemoryFile file(path_);
  {
    const hdf5::Group root = file.root();
    root.set_attribute("format", kMotionArchive.name());
    root.set_attribute("format_version", kMotionFormatVersion + 1);
  }
  write_archive(path_, file);
  EXPECT_THAT(message_of<InputError>(read), HasSubstr(": a newer touchfield reads it"));
}

TEST_F(DamagedMotionFile, IsRefused) {
  const auto read = [&] { read_motion_file(path_); };
  write_motion_file(path_, full_motion());
  expect_damage_is_seen(path_, read, 50, 100);
}

/// What a forged method says of two frames and two scores of one channel.
struct Forged {
  hdf5::Shape phases = {2, 1};
  hdf5::Shape cost = {2, 1};
  std::array<std::int64_t, 2> frame = {0, 1};
  std::array<std::int64_t, 2> silent = {0, 1};
  std::vector<std::string> status = {"converged", "direct"};
  std::uint64_t displaced = 2;
  std::uint64_t stage = 2;
};

void forge(const std::string& path, const Forged& forged) {
  const hdf5::MemoryFile file(path);
  {
    const hdf5::Group root = file.root();
    forge_beginning(root, kMotionArchive.name(), kMotionFormatVersion);
    root.set_attribute("seconds", 1.0);
    const std::array<double, 9> numbers = {0, 0, 0, 1, 0, 0, 0, 1, 0};
    const hdf5::Group method = root.create("methods").create("focus");
    method.set_attribute("method", "focus");
    method.set_attribute("scheme", "");
    method.set_attribute("dropped", 0);
    const hdf5::Group frames = method.create("frames");
    for (const char* name : {"sampled", "started", "late", "shown", "pose_time"}) {
      frames.write(name, numbers.data(), {2}, "s");
    }
    frames.write("silent", forged.silent.data(), {2}, "1");
    frames.write("steps", forged.silent.data(), {2}, "1");
    frames.write_texts("status", forged.status);
    frames.write("phases", numbers.data(), forged.phases, "rad");
    frames.write("amplitudes", numbers.data(), {2, 1}, "1");
    frames.write("cost", numbers.data(), forged.cost, "Pa2");
    frames.create("seconds").write("pose", numbers.data(), {forged.stage}, "s");
    const hdf5::Group scores = method.create("scores");
    scores.write("time", numbers.data(), {2}, "s");
    scores.write("age", numbers.data(), {2}, "s");
    scores.write("frame", forged.frame.data(), {2}, "1");
    scores.write("displacement", numbers.data(), {forged.displaced, 3}, "m");
    root.create("provenance");
  }
  write_archive(path, file);
}

TEST_F(DamagedMotionFile, SizesThatContradictEachOtherAreErrors) {
  forge(path_, {});
  const Motion read = read_motion_file(path_);  // without any metric, as if they came later
  ASSERT_EQ(read.methods.size(), 1U);
  EXPECT_TRUE(read.methods[0].frames[1].silent);
  EXPECT_FALSE(read.methods[0].frames[1].lost) << "the file is without it";
  EXPECT_TRUE(std::isnan(read.methods[0].frames[1].off.skin));
  EXPECT_TRUE(std::isnan(read.methods[0].frames[1].target_off));
  EXPECT_TRUE(std::isnan(read.methods[0].scores[1].metrics.relative_error));
  const std::vector<std::pair<std::string, Forged>> cases = {
      {"/methods/focus/frames/phases: has shape [2, 2], must have [2, 1]", {.phases = {2, 2}}},
      {"phases", {.phases = {3, 1}}},
      {"cost must be", {.cost = {2}}},
      {"cost", {.cost = {1, 2}}},
      {"score 1", {.frame = {0, 2}}},
      {"out of range", {.frame = {0, 1LL << 40}}},
      {"silent[1] = 2 is out of range", {.silent = {0, 2}}},
      {"status has 1 texts, must have 2", {.status = {"converged"}}},
      {"unknown status 'happy'", {.status = {"converged", "happy"}}},
      {"displacement", {.displaced = 1}},
      {"pose has 3 values, must have 2", {.stage = 3}}};
  for (const auto& [phrase, forged] : cases) {
    forge(path_, forged);
    EXPECT_THAT(message_of<InputError>([&] { read_motion_file(path_); }), HasSubstr(phrase));
  }
}

}  // namespace touchfield::motion_file_test
