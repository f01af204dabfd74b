#include <csignal>
#include <iostream>
#include <poll.h>
#include <unistd.h>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "sim/batch/sweep.h"
#include "sim/batch/sweep_case.h"
#include "sim/batch/worker_process.h"
#include "sim/core/errors.h"
#include "sim/scene/scene_reader.h"
#include "tests/support/output_support.h"
#include "tests/support/testing.h"

namespace touchfield {
namespace {

using support::message_of;
using support::TemporaryDirectory;
using support::write_bytes;
using ::testing::AllOf;
using ::testing::Each;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Pair;
using ::testing::UnorderedElementsAre;

// Workers are this program itself: what they make of a case is written in what the case changes.
const std::vector<std::string> kWorker = {"/proc/self/exe", "--worker"};
const std::vector<std::string> kDeafWorker = {"/bin/sleep", "1000"};  // never reads a job

int pretend_to_compute() {
  std::string line;
  while (std::getline(std::cin, line)) {
    const CaseJob job = job_from_json(line);
    const std::string& act = job.inputs.front().second;
    if (act == "dies") {
      raise(SIGKILL);
    }
    if (act == "stops") {
      raise(SIGSTOP);
    }
    SweepRecord record;
    record.number = job.number;
    record.inputs = job.inputs;
    record.status = act == "no room" ? kNoRoom : act.starts_with("says") ? "failed" : "ok";
    if (act == "says its card") {
      record.reason = job.card;
    }
    record.seconds = 0.01;
    write_bytes(job.scratch + "/run.h5", "result of " + act);
    std::cout << to_json(CaseCost{.memory_mib = 30, .available_mib = 70, .seconds = 0.5}) << std::endl;
    std::getline(std::cin, line);
    if (act == "says its threads") {
      record.reason = fmt::format("{}, then {}", job.threads, line);
    }
    std::cout << to_json(record, -1) << std::flush;
  }
  return 0;
}

/// A sweep whose cases act as told, in a directory of its own.
class Sweep {
 public:
  explicit Sweep(const std::vector<std::string>& acts, const std::string& scene = R"(
name: tiny
array: {grid: {count: [2, 2], pitch_mm: 10}}
body: {sphere: {radius_mm: 6}, place: {at_mm: [0, 0, 60]}, edge_mm: 3}
solve: {methods: [{fixed: {phases_rad: 0}}]}
)") {
    for (const std::string& act : acts) {
      const int number = static_cast<int>(input_.plan.cases.size()) + 1;
      input_.plan.cases.push_back({number, {{"act", act}}});
      input_.scenes.push_back(read_scene_text(scene, "tiny.yaml", ""));
    }
    input_.plan.parameters = {"act"};
    input_.plan.hash = "hash";
  }

  /// Statuses and reasons by number, of all there are afterwards.
  std::map<int, std::string> run(SweepOptions options) {
    SweepDirectory directory = open();
    SweepRunner runner(input_, directory, std::move(options));
    result_ = runner.run([](const SweepRecord&, const SweepProgress&) {});
    return outcomes();
  }

  std::map<int, std::string> outcomes() const {
    std::map<int, std::string> outcomes;
    for (const auto& [number, record] : read_records(folder_.path()).whole) {
      outcomes[number] = record.status == "ok" ? "ok" : record.reason;
    }
    return outcomes;
  }

  SweepDirectory open() const { return input_.open(folder_.path()); }
  SweepRunner runner(SweepDirectory& directory, SweepOptions options) const {
    return {input_, directory, std::move(options)};
  }
  const SweepResult& result() const { return result_; }
  std::string file(const std::string& name) const { return folder_.file(name); }

 private:
  TemporaryDirectory folder_;
  SweepInput input_;
  SweepResult result_;
};

SweepOptions options_for(int jobs, double case_seconds = 0.0, const std::vector<std::string>& worker = kWorker) {
  SweepOptions options;
  options.worker = worker;
  options.threads = options.jobs = jobs;
  options.case_seconds = case_seconds;
  return options;
}

TEST(SweepRunner, WorkersTakeCardsInTurn) {
  Sweep sweep({"says its card", "says its card", "says its card", "says its card"});
  SweepOptions options = options_for(2);
  options.cards = {"3", "GPU-5"};
  std::map<std::string, int> cases;
  for (const auto& [number, card] : sweep.run(options)) {
    ++cases[card];
  }
  EXPECT_EQ(cases.size(), 2U);
  EXPECT_EQ(cases["3"] + cases["GPU-5"], 4);
}

// Cases of 30 MiB where there are 70: the first has all threads until it has said so, and is alone.
TEST(SweepRunner, AsManyJobsAsThereIsMemoryFor) {
  Sweep sweep(std::vector<std::string>(4, "says its threads"));
  SweepOptions options = options_for(4);
  std::vector<int> jobs;
  options.expected = [&](const CaseCost& cost, int by_memory) {
    EXPECT_EQ(cost.memory_mib, 30);
    jobs.push_back(by_memory);
  };
  EXPECT_THAT(sweep.run(options), UnorderedElementsAre(Pair(1, "4, then 2"), Pair(2, "2, then 2"), Pair(3, "2, then 2"),
                                                       Pair(4, "2, then 2")));
  EXPECT_THAT(jobs, ::testing::ElementsAre(2));
  EXPECT_EQ(sweep.result().jobs, 2);
}

TEST(WorkerProcess, AnswersALineALine) {
  const TemporaryDirectory folder;
  WorkerProcess cat({"/bin/cat"}, folder.file("log"));
  cat.send("one");
  cat.send("two");
  std::vector<std::string> lines;
  while (lines.size() < 2) {
    pollfd waiting{cat.socket(), POLLIN, 0};
    ASSERT_EQ(poll(&waiting, 1, 60'000), 1);
    for (auto answer = cat.receive(); answer.line; answer = cat.receive()) {
      lines.push_back(*answer.line);
    }
  }
  EXPECT_THAT(lines, ::testing::ElementsAre("one", "two"));
}

// Some MiB do not fit into a socket that nobody reads.
TEST(WorkerProcess, NobodyWaitsForOneThatDoesNotRead) {
  const TemporaryDirectory folder;
  WorkerProcess deaf(kDeafWorker, folder.file("log"));
  deaf.send(std::string(4 << 20, 'x'));
  EXPECT_TRUE(deaf.has_rest());
  deaf.kill();
  EXPECT_EQ(deaf.how_it_ended(), "signal 9 (Killed)");
  deaf.send_rest();
  EXPECT_FALSE(deaf.has_rest());
}

TEST(WorkerProcess, AllOfALongLineArrives) {
  const TemporaryDirectory folder;
  WorkerProcess cat({"/bin/cat"}, folder.file("log"));
  const std::string text(1 << 20, 'y');
  cat.send(text);
  EXPECT_TRUE(cat.has_rest());
  WorkerProcess::Answer answer;
  while (!answer.line && !answer.ended) {
    pollfd waiting{cat.socket(), static_cast<short>(POLLIN | (cat.has_rest() ? POLLOUT : 0)), 0};
    ASSERT_GT(poll(&waiting, 1, 60'000), 0);
    cat.send_rest();
    answer = cat.receive();
  }
  EXPECT_EQ(answer.line, text);
}

TEST(WorkerProcess, SaysHowItEnded) {
  const TemporaryDirectory folder;
  WorkerProcess program({"/bin/sh", "-c", "exit 3"}, folder.file("log"));
  EXPECT_EQ(program.how_it_ended(), "exit code 3");
  WorkerProcess missing({"/nowhere/program"}, folder.file("log"));
  EXPECT_EQ(missing.how_it_ended(), "exit code 127");
}

TEST(SweepRunner, ComputesEveryCaseOnce) {
  Sweep sweep(std::vector<std::string>(50, "works"));
  EXPECT_THAT(sweep.run(options_for(3)), AllOf(::testing::SizeIs(50), Each(Pair(::testing::_, "ok"))));
  EXPECT_EQ(sweep.result().computed, 50);
  sweep.run(options_for(3));
  EXPECT_EQ(sweep.result().computed, 0);
}

TEST(SweepRunner, DeadAndStoppedProcessesFailTheirCasesOnly) {
  Sweep sweep({"works", "dies", "works", "stops", "works", "dies", "works"});
  EXPECT_THAT(sweep.run(options_for(2, 5.0)),
              UnorderedElementsAre(Pair(1, "ok"), Pair(2, HasSubstr("ended by signal 9")), Pair(3, "ok"),
                                   Pair(4, HasSubstr("took longer than 5 s")), Pair(5, "ok"),
                                   Pair(6, HasSubstr("ended by signal 9")), Pair(7, "ok")));
}

// A stopped process is given up after minutes, a large case is not: neither by a small estimate nor after small ones.
TEST(SweepRunner, WithoutALimitACaseHasTimeByWhatIsExpected) {
  EXPECT_EQ(case_limit(0.0, 0.0), 600.0);
  EXPECT_GE(case_limit(3600.0, 5.0), 10.0 * 3600.0);
  EXPECT_GE(case_limit(1.0, 3600.0), 10.0 * 3600.0);
  EXPECT_LE(case_limit(1.0, 10.0), 1000.0);
}

TEST(SweepRunner, AProcessThatDoesNotTakeItsJobIsGivenUp) {
  std::string positions;
  for (int i = 0; i < 10'000; ++i) {
    positions += fmt::format("{}[{}, 0, 0]", i == 0 ? "" : ", ", i);
  }
  Sweep sweep({"works"}, fmt::format(R"(
name: large
array: {{positions: {{points_mm: [{}]}}}}
body: {{sphere: {{radius_mm: 6}}, place: {{at_mm: [0, 0, 60]}}, edge_mm: 3}}
solve: {{methods: [{{fixed: {{phases_rad: 0}}}}]}}
)",
                                     positions));
  EXPECT_THAT(sweep.run(options_for(1, 1.0, kDeafWorker)), UnorderedElementsAre(Pair(1, HasSubstr("longer than 1 s"))));
  EXPECT_THAT(sweep.run(options_for(1)), UnorderedElementsAre(Pair(1, HasSubstr("longer than 1 s"))));
  SweepOptions retry = options_for(1);
  retry.retry_failed = true;
  EXPECT_THAT(sweep.run(retry), UnorderedElementsAre(Pair(1, "ok")));
}

TEST(SweepRunner, WithoutRoomItStopsAndKeepsNothingOfTheCase) {
  Sweep sweep({"works", "no room", "works"});
  EXPECT_THAT(message_of<IoError>([&] { sweep.run(options_for(1)); }),
              AllOf(HasSubstr("case 2"), HasSubstr("1 of 3 cases are kept"), HasSubstr("the same command continues")));
  EXPECT_THAT(sweep.outcomes(), UnorderedElementsAre(Pair(1, "ok")));
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(sweep.file("cases")), {}), 1);
}

TEST(SweepRunner, DamagedCasesAreFoundAndComputedAnew) {
  Sweep sweep(std::vector<std::string>(4, "works"));
  sweep.run(options_for(1));
  std::filesystem::remove(sweep.file("cases/00002/run.h5"));
  write_bytes(sweep.file("cases/00003/run.h5"), "result of wOrks");
  {
    SweepDirectory directory = sweep.open();
    const SweepRunner runner = sweep.runner(directory, options_for(1));
    EXPECT_THAT(runner.damaged(), UnorderedElementsAre(Pair(2, HasSubstr("00002/run.h5: No such file or directory")),
                                                       Pair(3, HasSubstr("00003/run.h5: its checksum"))));
    EXPECT_EQ(runner.left(), 2);
  }
  EXPECT_THAT(sweep.run(options_for(1)), AllOf(::testing::SizeIs(4), Each(Pair(::testing::_, "ok"))));
  EXPECT_EQ(sweep.result().computed, 2);
}

TEST(SweepRunner, AnInterruptKeepsWhatIsDone) {
  Sweep sweep({"works", "works", "stops", "works", "stops"});
  struct Interrupted {};
  int done = 0;
  SweepOptions options = options_for(2);
  options.tick = [&] {
    if (done >= 2) {
      throw Interrupted{};
    }
  };
  SweepDirectory directory = sweep.open();
  SweepRunner runner = sweep.runner(directory, options);
  EXPECT_THROW(runner.run([&](const SweepRecord&, const SweepProgress&) { ++done; }), Interrupted);
  EXPECT_EQ(runner.result().summary.records.size(), static_cast<std::size_t>(done));
  EXPECT_EQ(sweep.outcomes().size(), static_cast<std::size_t>(done));
  EXPECT_TRUE(std::filesystem::exists(sweep.file("sweep.csv")));
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(sweep.file("cases")), {}), done);
}

}  // namespace
}  // namespace touchfield

int main(int argc, char** argv) {
  if (argc > 1 && std::string(argv[1]) == "--worker") {
    return touchfield::pretend_to_compute();
  }
  std::signal(SIGPIPE, SIG_IGN);
  testing::InitGoogleMock(&argc, argv);
  return RUN_ALL_TESTS();
}
