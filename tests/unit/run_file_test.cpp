#include "sim/output/run_file.h"

#include <chrono>
#include <csignal>
#include <cstring>
#include <random>
#include <sstream>
#include <sys/resource.h>
#include <sys/stat.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "sim/core/errors.h"
#include "sim/output/checksum.h"
#include "sim/output/hdf5_file.h"
#include "tests/unit/output_support.h"

namespace touchfield {
namespace {

using support::bare_run;
using support::full_run;
using support::read_bytes;
using support::RunData;
using support::sheet;
using support::TemporaryDirectory;
using support::write_bytes;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

/// Equal to the last bit, NaN included.
template <class A, class B>
void expect_same_bits(const A& a, const B& b) {
  ASSERT_EQ(a.size(), b.size());
  if (a.size() > 0) {
    EXPECT_EQ(std::memcmp(a.data(), b.data(), sizeof(*a.data()) * static_cast<std::size_t>(a.size())), 0);
  }
}

void expect_same_bits(double a, double b) { EXPECT_EQ(std::memcmp(&a, &b, sizeof(a)), 0) << a << " and " << b; }

void expect_same(const MethodResult& a, const MethodResult& b) {
  EXPECT_EQ(a.name, b.name);
  EXPECT_EQ(a.method, b.method);
  EXPECT_EQ(a.scheme, b.scheme);
  EXPECT_EQ(a.solution.status, b.solution.status);
  EXPECT_EQ(a.solution.iterations, b.solution.iterations);
  EXPECT_EQ(a.solution.cost_history, b.solution.cost_history);
  EXPECT_EQ(a.seconds, b.seconds);
  expect_same_bits(a.solution.phases, b.solution.phases);
  expect_same_bits(a.solution.amplitudes, b.solution.amplitudes);
  expect_same_bits(a.pressure, b.pressure);
  for (const MetricField& field : metric_fields()) {
    SCOPED_TRACE(field.name);
    expect_same_bits(a.metrics.*field.value, b.metrics.*field.value);
  }
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

void expect_same(const Provenance& a, const Provenance& b) {
  EXPECT_EQ(a.version, b.version);
  EXPECT_EQ(a.revision, b.revision);
  EXPECT_EQ(a.compiler, b.compiler);
  EXPECT_EQ(a.flags, b.flags);
  EXPECT_EQ(a.machine, b.machine);
  EXPECT_EQ(a.threads, b.threads);
  EXPECT_EQ(a.seeds, b.seeds);
  EXPECT_EQ(a.command_line, b.command_line);
  EXPECT_EQ(a.start, b.start);
  EXPECT_EQ(a.end, b.end);
  EXPECT_EQ(a.scene_hash, b.scene_hash);
}

void expect_same(const Run& a, const Run& b) {
  EXPECT_EQ(a.name, b.name);
  EXPECT_EQ(a.scene, b.scene);
  EXPECT_EQ(a.judged, b.judged);
  EXPECT_EQ(a.complete, b.complete);
  EXPECT_EQ(a.seconds, b.seconds);
  EXPECT_EQ(a.warnings, b.warnings);
  expect_same(a.provenance, b.provenance);
  expect_same_bits(a.mesh.vertices(), b.mesh.vertices());
  expect_same_bits(a.mesh.triangles(), b.mesh.triangles());
  expect_same_bits(a.mesh.areas(), b.mesh.areas());
  EXPECT_EQ(a.array.kind, b.array.kind);
  EXPECT_EQ(a.array.directivity.kind(), b.array.directivity.kind());
  expect_same_bits(a.array.positions, b.array.positions);
  expect_same_bits(a.array.axes, b.array.axes);
  expect_same_bits(a.array.amplitudes, b.array.amplitudes);
  expect_same_bits(a.array.device, b.array.device);
  expect_same_bits(a.array.channel, b.array.channel);
  ASSERT_EQ(a.target.has_value(), b.target.has_value());
  if (a.target) {
    EXPECT_EQ(a.target->faces, b.target->faces);
    EXPECT_EQ(a.target->box, b.target->box);
    expect_same_bits(a.target->amplitudes, b.target->amplitudes);
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

template <class Error, class Action>
std::string message_of(const Action& action) {
  try {
    action();
  } catch (const Error& error) {
    return error.what();
  } catch (const std::exception& error) {
    ADD_FAILURE() << "another error: " << error.what();
    return {};
  }
  ADD_FAILURE() << "no error";
  return {};
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
  const hdf5::InputFile file(path);
  for (const char* absent : {"target", "methods", "judge", "field", "seconds", "warnings"}) {
    EXPECT_FALSE(file.root().has(absent)) << absent;
  }
}

TEST(RunFile, APlaneWaveAndAMethodWithoutPressure) {
  const TemporaryDirectory directory;
  const std::string path = directory.file("run.h5");
  RunData run = bare_run(sheet(1, 1, 0.01));
  run.array = plane_wave(Vector3::UnitZ(), 1.5);
  run.methods.push_back(support::made_up_method("fixed", run, 0.5));
  run.methods[0].pressure.resize(0);
  run.judged = true;
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

TEST(RunFile, TheJudgesGroupsLeadToTheSolvingModel) {
  const TemporaryDirectory directory;
  const std::string path = directory.file("run.h5");
  const RunData run = full_run();
  write_run_file(path, run);
  const hdf5::InputFile file(path);
  const hdf5::Group judge = file.root().open("judge");
  EXPECT_EQ(judge.text_attribute("judge"), "same");
  EXPECT_EQ(judge.open("mesh").shape("triangles"), (hdf5::Shape{48, 3}));
  EXPECT_EQ(judge.open("target").shape("face"), (hdf5::Shape{3}));
  Eigen::VectorXcd pressure(48);
  judge.open("methods").open("surface").read("pressure", {48}, pressure.data());
  EXPECT_EQ(pressure, run.methods[0].pressure);
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
  EXPECT_THAT(refused([](RunData& run) { run.array.device.conservativeResize(2); }), HasSubstr("device"));
  EXPECT_EQ(directory.entries(), 0U);
}

TEST(RunFile, FilesThatAreNoRunsAreInputErrors) {
  const TemporaryDirectory directory;
  const std::string path = directory.file("x.h5");
  const auto read = [&] { read_run_file(path); };
  EXPECT_THAT(message_of<InputError>(read), AllOf(HasSubstr(path), HasSubstr("No such file")));
  EXPECT_THAT(message_of<InputError>([&] { read_run_file(directory.path()); }), HasSubstr("is no file"));
  write_bytes(path, "");
  EXPECT_THAT(message_of<InputError>(read), HasSubstr("no HDF5 file"));
  write_bytes(path, std::string(5000, 'x'));
  EXPECT_THAT(message_of<InputError>(read), HasSubstr("no HDF5 file"));
  const auto write_other = [&](auto&& fill) {
    const hdf5::MemoryFile file(path);
    fill(file.root());
    const std::string bytes = file.bytes();
    write_bytes(path, bytes + checksum_line(bytes));
  };
  write_other([](const hdf5::Group& root) { root.set_attribute("title", "something else"); });
  EXPECT_THAT(message_of<InputError>(read), HasSubstr("no touchfield run"));
  write_other([](const hdf5::Group& root) {
    root.set_attribute("format", "touchfield-run");
    root.set_attribute("format_version", kRunFormatVersion + 1);
  });
  EXPECT_THAT(message_of<InputError>(read), HasSubstr("newer"));
}

TEST(RunFile, AFileThatIsCutIsNeverRead) {
  const TemporaryDirectory directory;
  const std::string whole = directory.file("whole.h5");
  const std::string cut = directory.file("cut.h5");
  write_run_file(whole, full_run());
  const std::string bytes = read_bytes(whole);
  const std::size_t step = bytes.size() / 300 + 1;
  for (std::size_t size = 0; size < bytes.size(); size += size + 100 < bytes.size() ? step : 1) {
    write_bytes(cut, bytes.substr(0, size));
    EXPECT_THROW(read_run_file(cut), Error) << size << " of " << bytes.size();
  }
  write_bytes(cut, bytes + "more");
  EXPECT_THROW(read_run_file(cut), Error);
}

TEST(RunFile, AChangedByteIsNeverRead) {
  const TemporaryDirectory directory;
  const std::string path = directory.file("run.h5");
  write_run_file(path, full_run());
  const std::string bytes = read_bytes(path);
  std::mt19937 random(1);
  for (int trial = 0; trial < 500; ++trial) {
    std::string damaged = bytes;
    const std::size_t at = random() % bytes.size();
    damaged[at] = static_cast<char>(static_cast<unsigned char>(damaged[at]) ^ (1U << (random() % 8)));
    write_bytes(path, damaged);
    EXPECT_THROW(read_run_file(path), Error) << "byte " << at;
  }
}

// Without the line HDF5 would have to be trusted with whatever the file holds.
TEST(RunFile, AFileWithoutItsChecksumLineIsRefused) {
  const TemporaryDirectory directory;
  const std::string path = directory.file("run.h5");
  write_run_file(path, full_run());
  const std::string bytes = read_bytes(path);
  write_bytes(path, bytes.substr(0, bytes.size() - kChecksumLength));
  EXPECT_THAT(message_of<InputError>([&] { read_run_file(path); }), AllOf(HasSubstr(path), HasSubstr("checksum line")));
}

TEST(Checksum, IsTheCrc32OfEverythingBeforeTheLine) {
  // The check value of the CRC-32 catalogue, for the digits 1 to 9.
  EXPECT_EQ(checksum_line("123456789"), "touchfield-crc32 cbf43926\n");
  EXPECT_EQ(checksum_line("").size(), kChecksumLength);
}

// Sizes and indices that only a forged file has: the checksum fits, the parts do not.
TEST(RunFile, SizesThatContradictEachOtherAreErrors) {
  const TemporaryDirectory directory;
  const std::string path = directory.file("run.h5");
  const auto forge = [&](auto&& fill) {
    const hdf5::MemoryFile file(path);
    {
      const hdf5::Group root = file.root();
      root.set_attribute("format", "touchfield-run");
      root.set_attribute("format_version", 1);
      root.set_attribute("name", "forged");
      root.set_attribute("complete", 1);
      root.write_text("scene", "");
      fill(root);
    }
    const std::string bytes = file.bytes();
    write_bytes(path, bytes + checksum_line(bytes));
    return message_of<IoError>([&] { read_run_file(path); });
  };
  const std::array<double, 9> corners = {0, 0, 0, 1, 0, 0, 0, 1, 0};
  EXPECT_THAT(forge([](const hdf5::Group&) {}), HasSubstr("no group mesh"));
  EXPECT_THAT(forge([&](const hdf5::Group& root) {
                const hdf5::Group mesh = root.create("mesh");
                mesh.write("vertices", corners.data(), {9}, "m");
                root.create("array");
              }),
              AllOf(HasSubstr("/mesh"), HasSubstr("vertices must be [n, 3]")));
  const std::array<int, 3> wrong_index = {0, 1, 7};
  EXPECT_THAT(forge([&](const hdf5::Group& root) {
                const hdf5::Group mesh = root.create("mesh");
                mesh.write("vertices", corners.data(), {3, 3}, "m");
                mesh.write("triangles", wrong_index.data(), {1, 3}, "1");
                root.create("array");
              }),
              HasSubstr("/mesh"));
  EXPECT_THAT(forge([&](const hdf5::Group& root) {
                const hdf5::Group mesh = root.create("mesh");
                mesh.write("vertices", wrong_index.data(), {1, 3}, "m");
                root.create("array");
              }),
              HasSubstr("does not hold floats"));
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

TEST(Hdf5File, ASizeThatTheFileDoesNotHoldIsRefused) {
  const TemporaryDirectory directory;
  const std::string path = directory.file("x.h5");
  const hdf5::MemoryFile file(path);
  const std::vector<double> zeros(1 << 16, 0.0);  // chunked; zeros pack at about 1,000 to 1
  file.root().write("zeros", zeros.data(), {zeros.size()}, "1");
  write_bytes(path, file.bytes());
  const hdf5::InputFile input(path);
  EXPECT_EQ(input.root().shape("zeros"), (hdf5::Shape{zeros.size()}));
  std::vector<double> out(3);
  EXPECT_THAT(message_of<IoError>([&] { input.root().read("zeros", {3}, out.data()); }),
              AllOf(HasSubstr("zeros"), HasSubstr("[65536]"), HasSubstr("[3]")));
}

TEST(Hdf5File, ErrorsNameThePlaceAndTheLibrarysReason) {
  const TemporaryDirectory directory;
  const std::string path = directory.file("x.h5");
  const hdf5::MemoryFile file(path);
  ::testing::internal::CaptureStderr();
  EXPECT_THAT(message_of<IoError>([&] { file.root().open("nothing"); }),
              AllOf(HasSubstr(path + ": /nothing"), HasSubstr("doesn't exist")));
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
}

TEST(Describe, SaysWhatThereIs) {
  const std::string text = describe_run(full_run());
  for (const char* part :
       {"complete", "48 faces", "35 vertices", "24 cm2", "6 transducers", "t4010a1", "3 faces", "2000 Pa", "surface",
        "paper-2", "35.00 %", "5.25", "stalled", "direct", "side: 5 x 1 x 4", "0123456789ab", "coarse mesh"}) {
    EXPECT_THAT(text, HasSubstr(part));
  }
  EXPECT_THAT(text, Not(HasSubstr("NOT COMPLETE")));
  EXPECT_THAT(text, Not(HasSubstr("nan")));
}

TEST(Describe, ARunWithoutTargetOrMethods) {
  const std::string text = describe_run(bare_run(sheet(1, 1, 0.01)));
  EXPECT_THAT(text, AllOf(HasSubstr("NOT COMPLETE"), HasSubstr("target    none"), HasSubstr("no method has finished")));
}

TEST(MetricsCsv, OneLineAMethodAndQuotesWhereTheyAreNeeded) {
  const TemporaryDirectory directory;
  const std::string path = directory.file("metrics.csv");
  RunData run = full_run();
  run.methods[0].scheme = "chief, 3 \"points\"";
  run.methods[1].metrics.relative_error = -kNotComputed;
  write_metrics_csv(path, run);
  std::istringstream lines(read_bytes(path));
  std::string header;
  std::string first;
  std::string second;
  std::string rest;
  ASSERT_TRUE(std::getline(lines, header) && std::getline(lines, first) && std::getline(lines, second));
  EXPECT_FALSE(std::getline(lines, rest));
  std::string expected = "name,method,scheme";
  for (const MetricField& field : metric_fields()) {
    expected += std::string(",") + field.name;
  }
  EXPECT_EQ(header, expected + ",status");
  EXPECT_THAT(first, AllOf(::testing::StartsWith("surface,paper,\"chief, 3 \"\"points\"\"\",0.35,nan,"),
                           ::testing::EndsWith(",stalled")));
  EXPECT_THAT(second, ::testing::StartsWith("paper-2,paper,chief,nan,nan,"));
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
