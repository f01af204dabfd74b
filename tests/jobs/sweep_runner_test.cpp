#include <csignal>
#include <iostream>
#include <unistd.h>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "sim/core/errors.h"
#include "sim/jobs/sweep.h"
#include "sim/jobs/sweep_case.h"
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
using ::testing::Pair;
using ::testing::UnorderedElementsAre;

// Workers are this program itself: what they make of a case is written in what the case changes.
const std::vector<std::string> kWorker = {"/proc/self/exe", "--worker"};
const std::vector<std::string> kDeafWorker = {"/bin/sleep", "1000"};  // never reads a job

int pretend_to_compute() {
  std::string scratch;
  while (std::getline(std::cin, scratch)) {
    const CaseJob job = read_job(scratch);
    const std::string& act = job.inputs.front().second;
    if (act == "dies") raise(SIGKILL);
    if (act == "stops") raise(SIGSTOP);
    if (act == "no room") {
      std::cout << "no space is left" << std::endl;
      continue;
    }
    SweepRecord record;
    record.number = job.number;
    record.inputs = job.inputs;
    record.status = act.starts_with("fails") ? "failed" : "ok";
    record.reason = act == "says its card"      ? job.card
                    : act == "says its threads" ? fmt::format("{}", job.threads)
                                                : act;
    write_bytes(scratch + "/run.h5", "result of " + act);
    write_record(record, scratch);
    std::cout << kCaseDone << std::endl;
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

  /// Status and reason by number, of all there are afterwards.
  std::map<int, std::string> run(SweepOptions options) {
    result_ = run_sweep(input_, open(), options, progress_);
    return outcomes();
  }

  std::map<int, std::string> outcomes() const {
    std::map<int, std::string> outcomes;
    for (const auto& [number, record] : read_records(folder_.path()).whole) {
      outcomes[number] = record.status + ": " + record.reason;
    }
    return outcomes;
  }

  SweepDirectory open() const { return SweepDirectory::open(folder_.path(), input_.plan); }
  const SweepResult& result() const { return result_; }
  std::string file(const std::string& name) const { return folder_.file(name); }
  std::vector<std::string> case_folders() const {
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(file("cases"))) {
      names.push_back(entry.path().filename().string());
    }
    return names;
  }

 private:
  TemporaryDirectory folder_;
  SweepInput input_;
  SweepResult result_;
  Progress progress_;
};

SweepOptions options_for(int jobs, double case_seconds = 0.0, const std::vector<std::string>& worker = kWorker) {
  SweepOptions options;
  options.worker = worker;
  options.threads = options.jobs = jobs;
  options.case_seconds = case_seconds;
  return options;
}

SweepOptions only(int first, int last) {
  SweepOptions options = options_for(1);
  options.only = CaseRange{first, last};
  return options;
}

TEST(Sweep, WorkersTakeCardsInTurnAndShareTheThreads) {
  Sweep cards(std::vector<std::string>(4, "says its card"));
  SweepOptions options = options_for(2);
  options.cards = {"3", "GPU-5"};
  std::map<std::string, int> cases;
  for (const auto& [number, card] : cards.run(options)) ++cases[card];
  EXPECT_THAT(cases,
              ::testing::UnorderedElementsAre(Pair("ok: 3", ::testing::Gt(0)), Pair("ok: GPU-5", ::testing::Gt(0))));
  Sweep threads(std::vector<std::string>(4, "says its threads"));
  options.threads = 7;
  EXPECT_THAT(threads.run(options), Each(Pair(::testing::_, "ok: 3")));
}

TEST(Sweep, ComputesEveryCaseOnce) {
  Sweep sweep(std::vector<std::string>(50, "works"));
  EXPECT_THAT(sweep.run(options_for(3)), AllOf(::testing::SizeIs(50), Each(Pair(::testing::_, "ok: works"))));
  EXPECT_EQ(sweep.result().computed, 50);
  EXPECT_THAT(sweep.case_folders(), AllOf(::testing::SizeIs(50), Each(::testing::Not(HasSubstr(".")))));
  sweep.run(options_for(3));
  EXPECT_EQ(sweep.result().computed, 0);
}

TEST(Sweep, DeadAndStoppedProcessesFailTheirCasesOnly) {
  Sweep sweep({"works", "dies", "works", "stops", "works", "dies", "works"});
  EXPECT_THAT(sweep.run(options_for(2, 5.0)),
              UnorderedElementsAre(Pair(1, "ok: works"), Pair(2, HasSubstr("ended by signal 9")), Pair(3, "ok: works"),
                                   Pair(4, HasSubstr("took longer than 5 s")), Pair(5, "ok: works"),
                                   Pair(6, HasSubstr("ended by signal 9")), Pair(7, "ok: works")));
}

TEST(Sweep, AProcessThatDoesNotTakeItsJobIsGivenUpAndTheCaseAskedForAgain) {
  Sweep sweep({"works"});
  EXPECT_THAT(sweep.run(options_for(1, 1.0, kDeafWorker)), UnorderedElementsAre(Pair(1, HasSubstr("longer than 1 s"))));
  EXPECT_THAT(sweep.run(options_for(1)), UnorderedElementsAre(Pair(1, HasSubstr("longer than 1 s"))));
  write_bytes(sweep.file("cases/00001/notes.txt"), "mine");
  EXPECT_THAT(sweep.run(only(1, 1)), UnorderedElementsAre(Pair(1, "ok: works")));
  EXPECT_TRUE(std::filesystem::exists(sweep.file("cases/00001/notes.txt")));
}

TEST(Sweep, CasesOfARangeAloneAreComputedAndHaveNoTable) {
  Sweep sweep({"works", "fails", "works", "works"});
  EXPECT_THAT(sweep.run(only(2, 3)), UnorderedElementsAre(Pair(2, "failed: fails"), Pair(3, "ok: works")));
  EXPECT_EQ(sweep.result().summary.cases, 2);
  EXPECT_FALSE(std::filesystem::exists(sweep.file("sweep.csv")));
  sweep.run(only(2, 3));
  EXPECT_EQ(sweep.result().computed, 1);  // the one that has failed
  EXPECT_THAT(message_of<InputError>([&] { sweep.run(only(3, 5)); }),
              HasSubstr("case 3-5: the sweep has cases 1 to 4"));
}

TEST(Sweep, WithoutRoomItStopsAndKeepsNothingOfTheCase) {
  Sweep sweep({"works", "no room", "works"});
  EXPECT_THAT(
      message_of<IoError>([&] { sweep.run(options_for(1)); }),
      AllOf(HasSubstr("case 2: no space is left; 1 of 3 cases are kept"), HasSubstr("the same command continues")));
  EXPECT_THAT(sweep.outcomes(), UnorderedElementsAre(Pair(1, "ok: works")));
}

TEST(Sweep, WhatEndsItKeepsWhatIsDone) {
  Sweep sweep({"works", "works", "stops", "works", "stops"});
  int done = 0;
  SweepOptions options = options_for(2);
  options.on_case = [&](const SweepRecord&, const SweepProgress&) {
    if (++done == 2) throw done;
  };
  EXPECT_THROW(sweep.run(options), int);
  EXPECT_EQ(sweep.outcomes().size(), 2U);
  EXPECT_TRUE(std::filesystem::exists(sweep.file("sweep.csv")));
}

// What another process has locked is left to it, and computed here once it lets go.
TEST(Sweep, ACaseIsThatOfWhoHoldsItsLock) {
  Sweep sweep({"works", "works", "works"});
  const SweepDirectory directory = sweep.open();
  std::optional<FileLock> other = directory.lock(2);
  ASSERT_TRUE(other);
  EXPECT_FALSE(directory.lock(2));
  SweepOptions options = options_for(1);
  std::vector<int> order;
  options.on_case = [&](const SweepRecord& record, const SweepProgress& now) {
    order.push_back(record.number);
    EXPECT_EQ(now.done, static_cast<int>(order.size()));
    if (order.size() == 2) other.reset();
  };
  sweep.run(options);
  EXPECT_THAT(order, ::testing::ElementsAre(1, 3, 2));
}

TEST(Sweep, LeftoversOfDeadProcessesGoAndThoseOfLivingOnesStay) {
  Sweep sweep({"works", "works", "works"});
  const SweepDirectory directory = sweep.open();
  directory.scratch(1, true);
  const std::string held = directory.scratch(2, true);
  const std::string alone = directory.scratch(3, false);
  const std::optional<FileLock> other = directory.lock(2);
  directory.clear_leftovers({});
  EXPECT_TRUE(std::filesystem::exists(held) && std::filesystem::exists(alone));
  EXPECT_EQ(sweep.case_folders().size(), 4U);  // and two locks
  SweepRecord done;
  done.status = "ok";
  directory.clear_leftovers({{2, done}, {3, done}});
  EXPECT_THAT(sweep.case_folders(), UnorderedElementsAre(".00001.lock"));
}

}  // namespace
}  // namespace touchfield

int main(int argc, char** argv) {
  if (argc > 1 && std::string(argv[1]) == "--worker") return touchfield::pretend_to_compute();
  std::signal(SIGPIPE, SIG_IGN);
  testing::InitGoogleMock(&argc, argv);
  return RUN_ALL_TESTS();
}
