#include "sim/store/motion_file.h"

#include <functional>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "sim/core/errors.h"
#include "sim/store/checksum.h"
#include "sim/store/run_file.h"
#include "tests/support/error_support.h"
#include "tests/support/motion_support.h"
#include "tests/support/output_support.h"
#include "tests/support/same_support.h"

namespace touchfield {
namespace {

using support::expect_same;
using support::expect_same_bits;
using support::full_motion;
using support::message_of;
using support::read_bytes;
using support::sheet;
using support::TemporaryDirectory;
using support::write_bytes;
using ::testing::AllOf;
using ::testing::HasSubstr;

void expect_same(const MotionFrame& a, const MotionFrame& b) {
  expect_same_bits(a.sampled, b.sampled);
  expect_same_bits(a.started, b.started);
  expect_same_bits(a.late, b.late);
  expect_same_bits(a.shown, b.shown);
  expect_same_bits(a.pose_time, b.pose_time);
  EXPECT_EQ(a.quiet, b.quiet);
  EXPECT_EQ(a.lost, b.lost);
  expect_same_bits(a.off.skin, b.off.skin);
  expect_same_bits(a.off.patch, b.off.patch);
  expect_same_bits(a.target_off, b.target_off);
  expect_same(a.solution, b.solution);
  EXPECT_EQ(a.seconds, b.seconds);
}

void expect_same(const MotionScore& a, const MotionScore& b) {
  expect_same_bits(a.time, b.time);
  EXPECT_EQ(a.frame, b.frame);
  expect_same_bits(a.age, b.age);
  expect_same_bits(a.displacement, b.displacement);
  expect_same(a.metrics, b.metrics);
}

void expect_same(const Motion& a, const Motion& b) {
  EXPECT_EQ(a.name, b.name);
  EXPECT_EQ(a.scene, b.scene);
  expect_same_bits(a.seconds, b.seconds);
  EXPECT_EQ(a.complete, b.complete);
  EXPECT_EQ(a.timings, b.timings);
  EXPECT_EQ(a.warnings, b.warnings);
  EXPECT_EQ(a.notes, b.notes);
  EXPECT_EQ(a.solved_skin, b.solved_skin);
  EXPECT_EQ(a.judged_skin, b.judged_skin);
  expect_same(a.provenance, b.provenance);
  expect_same(a.array, b.array);
  expect_same(a.mesh, b.mesh);
  ASSERT_EQ(a.judge.has_value(), b.judge.has_value());
  if (a.judge) {
    expect_same(*a.judge, *b.judge);
  }
  ASSERT_EQ(a.methods.size(), b.methods.size());
  for (std::size_t m = 0; m < a.methods.size(); ++m) {
    SCOPED_TRACE(a.methods[m].name);
    EXPECT_EQ(a.methods[m].name, b.methods[m].name);
    EXPECT_EQ(a.methods[m].method, b.methods[m].method);
    EXPECT_EQ(a.methods[m].scheme, b.methods[m].scheme);
    EXPECT_EQ(a.methods[m].dropped, b.methods[m].dropped);
    ASSERT_EQ(a.methods[m].frames.size(), b.methods[m].frames.size());
    for (std::size_t i = 0; i < a.methods[m].frames.size(); ++i) {
      expect_same(a.methods[m].frames[i], b.methods[m].frames[i]);
    }
    ASSERT_EQ(a.methods[m].scores.size(), b.methods[m].scores.size());
    for (std::size_t i = 0; i < a.methods[m].scores.size(); ++i) {
      expect_same(a.methods[m].scores[i], b.methods[m].scores[i]);
    }
  }
}

TEST(MotionFile, ReadsBackWhatWasWritten) {
  const TemporaryDirectory directory("with space \xc3\xa4");
  const std::string path = directory.file("motion.h5");
  write_motion_file(path, full_motion());
  expect_same(full_motion(), read_motion_file(path));
  EXPECT_EQ(directory.entries(), 1U);  // no temporary file is left
  EXPECT_EQ(archive_format(path), kMotionArchive.name());
}

TEST(MotionFile, AMotionThatHasOnlyBegun) {
  const TemporaryDirectory directory;
  const std::string path = directory.file("motion.h5");
  Motion motion{.name = "bare", .scene = "", .array = full_motion().array, .mesh = sheet(1, 1, 0.01)};
  write_motion_file(path, motion);
  expect_same(motion, read_motion_file(path));
  motion.methods.push_back({.name = "surface", .method = "surface", .scheme = "chief"});  // no frame, no score
  write_motion_file(path, motion);
  expect_same(motion, read_motion_file(path));
  const hdf5::Content content = hdf5::read_content(path);
  for (const char* absent : {"judge", "seconds", "warnings", "notes"}) {
    EXPECT_FALSE(content.has(absent)) << absent;
  }
}

TEST(MotionFile, TheSameMotionGivesTheSameBytesAndReplacesAnOlderFile) {
  const TemporaryDirectory directory;
  Motion shorter = full_motion();
  shorter.methods.pop_back();
  write_motion_file(directory.file("a.h5"), shorter);
  write_motion_file(directory.file("a.h5"), full_motion());
  write_motion_file(directory.file("b.h5"), full_motion());
  EXPECT_EQ(read_bytes(directory.file("a.h5")), read_bytes(directory.file("b.h5")));
}

TEST(MotionFile, PartsThatDoNotFitAreRefusedBeforeAnythingIsWritten) {
  const TemporaryDirectory directory;
  const auto refused = [&](const std::function<void(Motion&)>& change) {
    Motion motion = full_motion();
    change(motion);
    return message_of<InputError>([&] { write_motion_file(directory.file("motion.h5"), motion); });
  };
  EXPECT_THAT(refused([](Motion& m) { m.methods[1].frames[2].solution.phases.conservativeResize(5); }),
              AllOf(HasSubstr("paper-2"), HasSubstr("frame 2"), HasSubstr("phases"), HasSubstr("must have 6")));
  EXPECT_THAT(refused([](Motion& m) { m.methods[0].frames[0].solution.amplitudes.resize(0); }),
              HasSubstr("amplitudes"));
  EXPECT_THAT(refused([](Motion& m) { m.methods[0].name = "paper-2"; }), HasSubstr("twice"));
  EXPECT_THAT(refused([](Motion& m) { m.methods[0].name = "a/b"; }), HasSubstr("a/b"));
  EXPECT_THAT(refused([](Motion& m) { m.methods[0].frames[3].seconds[1].first = "pose"; }), HasSubstr("twice"));
  EXPECT_THAT(refused([](Motion& m) { m.methods[0].frames[3].seconds[1].first = "a/b"; }), HasSubstr("a/b"));
  EXPECT_THAT(refused([](Motion& m) { m.methods[0].frames[3].seconds[1].second = kNotComputed; }),
              AllOf(HasSubstr("factorisation"), HasSubstr(">= 0")));
  EXPECT_THAT(refused([](Motion& m) { m.methods[0].scores[5].frame = 4; }),
              AllOf(HasSubstr("score 5"), HasSubstr("-1..3")));
  EXPECT_THAT(refused([](Motion& m) { m.methods[0].scores[5].frame = -2; }), HasSubstr("-1..3"));
  EXPECT_THAT(refused([](Motion& m) { m.methods[0].dropped = -1; }), HasSubstr("dropped"));
  EXPECT_THAT(refused([](Motion& m) { m.array.device.conservativeResize(2); }), HasSubstr("device"));
  EXPECT_EQ(directory.entries(), 0U);
}

TEST(DamagedMotionFile, FilesThatAreNoMotionsAreInputErrors) {
  const TemporaryDirectory directory;
  const std::string path = directory.file("x.h5");
  const auto read = [&] { read_motion_file(path); };
  EXPECT_THAT(message_of<InputError>(read), AllOf(HasSubstr(path), HasSubstr("No such file")));
  write_bytes(path, std::string(5000, 'x'));
  EXPECT_THAT(message_of<InputError>(read), HasSubstr("not an HDF5 file"));
  write_run_file(path, support::full_run());
  EXPECT_THAT(message_of<InputError>(read), HasSubstr("not a touchfield motion"));
  write_motion_file(path, full_motion());
  EXPECT_THAT(message_of<InputError>([&] { read_run_file(path); }), HasSubstr("not a touchfield run"));
  const hdf5::MemoryFile file(path);
  {
    const hdf5::Group root = file.root();
    root.set_attribute("format", kMotionArchive.name());
    root.set_attribute("format_version", kMotionFormatVersion + 1);
  }
  write_archive(path, file);
  EXPECT_THAT(message_of<InputError>(read), HasSubstr("newer"));
}

TEST(DamagedMotionFile, CutAndChangedFilesAreNeverRead) {
  const TemporaryDirectory directory;
  const std::string path = directory.file("motion.h5");
  write_motion_file(path, full_motion());
  const std::string bytes = read_bytes(path);
  for (std::size_t size = 0; size < bytes.size(); size += bytes.size() / 50 + 1) {
    write_bytes(path, bytes.substr(0, size));
    EXPECT_THROW(read_motion_file(path), InputError) << size << " of " << bytes.size();
  }
  std::mt19937 random(1);
  for (int trial = 0; trial < 100; ++trial) {
    std::string damaged = bytes;
    const std::size_t at = random() % bytes.size();
    damaged[at] = static_cast<char>(static_cast<unsigned char>(damaged[at]) ^ (1U << (random() % 8)));
    write_bytes(path, damaged);
    EXPECT_THROW(read_motion_file(path), InputError) << "byte " << at;
  }
}

// Damage that somebody has made to pass the checksum.
TEST(DamagedMotionFile, AForgedByteEndsInAnErrorOrInAMotion) {
  const TemporaryDirectory directory;
  const std::string path = directory.file("motion.h5");
  write_motion_file(path, full_motion());
  const std::string whole = read_bytes(path);
  const std::string bytes = whole.substr(0, whole.size() - kChecksumLength);
  std::mt19937 random(2);
  int refused = 0;
  for (int trial = 0; trial < 100; ++trial) {
    std::string forged = bytes;
    for (std::size_t change = 1 + random() % 4; change > 0; --change) {
      forged[random() % forged.size()] = static_cast<char>(random() % 256);
    }
    write_bytes(path, forged + checksum_line(forged));
    try {
      read_motion_file(path);
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), HasSubstr(path)) << "trial " << trial;
      ++refused;
    }
  }
  EXPECT_GT(refused, 0);
}

/// What a forged method says of two frames and two scores of one channel.
struct Forged {
  int version = 1;
  std::string scene{};
  hdf5::Shape phases = {2, 1};
  hdf5::Shape cost = {2, 1};
  std::array<std::int64_t, 2> frame = {0, 1};
  std::array<std::int64_t, 2> quiet = {0, 1};
  std::vector<std::string> status = {"converged", "direct"};
  std::uint64_t displaced = 2;
  std::uint64_t stage = 2;
};

void forge(const std::string& path, const Forged& forged) {
  const hdf5::MemoryFile file(path);
  {
    const hdf5::Group root = file.root();
    root.set_attribute("format", kMotionArchive.name());
    root.set_attribute("format_version", forged.version);
    root.set_attribute("name", "forged");
    root.set_attribute("complete", 1);
    root.set_attribute("seconds", 1.0);
    root.write_text("scene", forged.scene);
    if (forged.version >= 3) {
      root.set_attribute("solved_skin", "whole");
      root.set_attribute("judged_skin", "part");
    }
    const std::array<double, 9> numbers = {0, 0, 0, 1, 0, 0, 0, 1, 0};
    const std::array<int, 3> triangle = {0, 1, 2};
    const hdf5::Group mesh = root.create("mesh");
    mesh.write("vertices", numbers.data(), {3, 3}, "m");
    mesh.write("triangles", triangle.data(), {1, 3}, "1");
    const hdf5::Group array = root.create("array");
    array.set_attribute("kind", "transducers");
    array.set_attribute("directivity", "omni");
    array.write("position", numbers.data(), {1, 3}, "m");
    array.write("axis", numbers.data() + 3, {1, 3}, "1");
    array.write("amplitude", numbers.data(), {1}, "Pa m");
    array.write("device", triangle.data(), {1}, "1");
    array.write("channel", triangle.data(), {1}, "1");
    const hdf5::Group method = root.create("methods").create("focus");
    method.set_attribute("method", "focus");
    method.set_attribute("scheme", "");
    method.set_attribute("dropped", 0);
    const hdf5::Group frames = method.create("frames");
    for (const char* name : {"sampled", "started", "late", "shown", "pose_time"}) {
      frames.write(name, numbers.data(), {2}, "s");
    }
    frames.write("quiet", forged.quiet.data(), {2}, "1");
    frames.write("steps", forged.quiet.data(), {2}, "1");
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

// In version 1 the two words for a hand's side meant each other's hand.
TEST(DamagedMotionFile, HandsKeepTheSideThatTheyHad) {
  const TemporaryDirectory directory;
  const std::string path = directory.file("motion.h5");
  forge(path, {.scene = "body:\n  hand:\n    side: right\n"});
  EXPECT_EQ(read_motion_file(path).scene, "body:\n  hand:\n    side: left\n");
  forge(path, {.version = kMotionFormatVersion, .scene = "body:\n  hand:\n    side: right\n"});
  EXPECT_EQ(read_motion_file(path).scene, "body:\n  hand:\n    side: right\n");
}

TEST(DamagedMotionFile, AnOlderFileIsOfThePartThatItKept) {
  const TemporaryDirectory directory;
  const std::string path = directory.file("motion.h5");
  forge(path, {.version = 2, .scene = "body:\n  keep_within_mm: 50\n"});
  EXPECT_EQ(read_motion_file(path).scene, "body:\n  keep_within_mm: 50\n  beyond: nothing\n");
  EXPECT_EQ(read_motion_file(path).solved_skin, SkinExtent::kPart);
  forge(path, {.version = 3, .scene = "body:\n  keep_within_mm: 50\n"});
  EXPECT_EQ(read_motion_file(path).scene, "body:\n  keep_within_mm: 50\n");
  EXPECT_EQ(read_motion_file(path).judged_skin, SkinExtent::kPart);
}

TEST(DamagedMotionFile, SizesThatContradictEachOtherAreErrors) {
  const TemporaryDirectory directory;
  const std::string path = directory.file("motion.h5");
  forge(path, {});
  const Motion read = read_motion_file(path);  // without any metric, as if they came later
  ASSERT_EQ(read.methods.size(), 1U);
  EXPECT_TRUE(read.methods[0].frames[1].quiet);
  EXPECT_FALSE(read.methods[0].frames[1].lost) << "the file is without it";
  EXPECT_TRUE(std::isnan(read.methods[0].frames[1].off.skin));
  EXPECT_TRUE(std::isnan(read.methods[0].frames[1].target_off));
  EXPECT_TRUE(std::isnan(read.methods[0].scores[1].metrics.relative_error));
  const auto message = [&](const Forged& forged) {
    forge(path, forged);
    return message_of<InputError>([&] { read_motion_file(path); });
  };
  EXPECT_THAT(message({.phases = {2, 2}}),
              AllOf(HasSubstr(path), HasSubstr("/methods/focus/frames"), HasSubstr("phases")));
  EXPECT_THAT(message({.phases = {3, 1}}), HasSubstr("phases"));
  EXPECT_THAT(message({.cost = {2}}), HasSubstr("cost must be"));
  EXPECT_THAT(message({.cost = {1, 2}}), HasSubstr("cost"));
  EXPECT_THAT(message({.frame = {0, 2}}), AllOf(HasSubstr("damaged"), HasSubstr("score 1"), HasSubstr("-1..1")));
  EXPECT_THAT(message({.frame = {0, 1LL << 40}}), HasSubstr("out of range"));
  EXPECT_THAT(message({.quiet = {0, 2}}), HasSubstr("quiet[1] = 2 is out of range"));
  EXPECT_THAT(message({.status = {"converged"}}), HasSubstr("status has 1 texts, must have 2"));
  EXPECT_THAT(message({.status = {"converged", "happy"}}), HasSubstr("unknown status 'happy'"));
  EXPECT_THAT(message({.displaced = 1}), HasSubstr("displacement"));
  EXPECT_THAT(message({.stage = 3}), HasSubstr("pose has 3 values, must have 2"));
}

}  // namespace
}  // namespace touchfield
