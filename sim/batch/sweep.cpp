#include "sim/batch/sweep.h"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <csignal>
#include <deque>
#include <memory>
#include <poll.h>
#include <span>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "sim/batch/sweep_case.h"
#include "sim/batch/worker_process.h"
#include "sim/core/atomic_file.h"
#include "sim/core/errors.h"
#include "sim/core/require.h"
#include "sim/core/version.h"
#include "sim/gpu/gpu_library.h"
#include "sim/scene/scene_reader.h"
#include "sim/solve/named_files.h"

namespace touchfield {

namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kTick{500};  // the limit of time is looked at so often

/// What a case changes, as its record keeps it.
std::vector<std::pair<std::string, std::string>> inputs_of(const SweepCase& item) {
  std::vector<std::pair<std::string, std::string>> inputs;
  for (const SceneChange& change : item.changes) {
    inputs.emplace_back(change.path, change.value);
  }
  return inputs;
}

}  // namespace

SweepInput read_sweep_input(const std::string& path, const std::vector<std::string>& overrides, Shard shard) {
  SweepInput input{{read_sweep(path, overrides), {}}, {}, shard};
  input.scenes = read_cases(input.plan);
  require_named_files(input.scenes);
  input.plan.hash = plan_hash(input.plan, input.scenes);
  return input;
}

Shard case_shard(int number, std::size_t cases) {
  require(number >= 1 && static_cast<std::size_t>(number) <= cases, "case {}: the sweep has cases 1 to {}", number,
          cases);
  return {number, static_cast<int>(cases)};
}

void share_cards(const std::vector<Scene>& scenes, SweepOptions& options) {
  const auto device_of = [](const Scene& scene) { return scene.solve.solver.device; };
  const bool on_first_card = std::ranges::all_of(scenes, [&](const Scene& scene) {
    return device_of(scene).kind == ComputeDevice::Kind::kCuda && device_of(scene).card == 0;
  });
  const bool leaves_open = std::ranges::all_of(
      scenes, [&](const Scene& scene) { return device_of(scene).kind == ComputeDevice::Kind::kAuto; });
  if (on_first_card || leaves_open) {
    options.cards = separate_cards();
  }
  if (on_first_card && options.jobs == 0) {  // several processes on one card wait for one another
    options.jobs = std::max(1, static_cast<int>(options.cards.size()));
  }
}

double case_limit(double expected, double longest) { return std::max(600.0 + 20.0 * expected, 10.0 * longest); }

/// Cases that share a body.
struct SweepRunner::Group {
  std::deque<std::size_t> left;  // places in the plan
  int size = 0;                  // of all cases of the plan, so that a resumed sweep chooses its solvers alike
};

struct SweepRunner::Worker {
  std::unique_ptr<WorkerProcess> process;
  Group* group = nullptr;            // of its last case, whose models it keeps
  std::optional<std::size_t> place;  // of the case it is at
  std::string scratch;
  Clock::time_point start;
  double spent = 0.0;     // on the case, while this process ran too [s]
  double expected = 0.0;  // as the process has said; 0 before [s]
};

SweepRunner::SweepRunner(const SweepInput& input, SweepDirectory& directory, SweepOptions options)
    : input_(input), directory_(directory), options_(std::move(options)), next_table_(Clock::now()) {
  CaseRecords found = directory.records();
  records_ = std::move(found.whole);
  damaged_ = std::move(found.damaged);
  const auto others = [&](const auto& entry) { return !input.shard.has(entry.first); };
  std::erase_if(records_, others);
  std::erase_if(damaged_, others);
  if (options_.retry_failed) {
    std::erase_if(records_, [](const auto& entry) { return entry.second.status != "ok"; });
  }
  const std::vector<int> numbers = body_groups(input.scenes);
  groups_.resize(numbers.empty() ? 0 : 1 + static_cast<std::size_t>(*std::ranges::max_element(numbers)));
  for (std::size_t i = 0; i < input.plan.cases.size(); ++i) {
    Group& group = groups_[static_cast<std::size_t>(numbers[i])];
    ++group.size;
    if (input.shard.has(input.plan.cases[i].number)) {
      ++cases_;
      if (!records_.contains(input.plan.cases[i].number)) {
        group.left.push_back(i);
      }
    }
  }
  const auto open = std::ranges::count_if(groups_, [](const Group& group) { return !group.left.empty(); });
  jobs_ = options_.jobs > 0 ? options_.jobs : std::min(options_.threads, static_cast<int>(open));
  jobs_ = std::clamp(jobs_, 1, std::max(1, left()));
  workers_.resize(static_cast<std::size_t>(jobs_));
}

SweepRunner::~SweepRunner() = default;

std::size_t SweepRunner::groups() const { return groups_.size(); }

int SweepRunner::threads_each() const { return std::max(1, options_.threads / jobs_); }

int SweepRunner::left() const {
  std::size_t count = 0;
  for (const Group& group : groups_) {
    count += group.left.size();
  }
  return static_cast<int>(count);
}

/// Its own group while that has cases; else one that no worker holds; else the one with most left.
SweepRunner::Group* SweepRunner::next_group(const Worker& worker) {
  if (worker.group != nullptr && !worker.group->left.empty()) {
    return worker.group;
  }
  Group* best = nullptr;
  bool best_is_held = true;
  for (Group& group : groups_) {
    if (group.left.empty()) {
      continue;
    }
    const bool held = std::ranges::any_of(workers_, [&](const Worker& other) { return other.group == &group; });
    if (best == nullptr || (best_is_held && !held) || (held == best_is_held && group.left.size() > best->left.size())) {
      best = &group;
      best_is_held = held;
    }
  }
  return best;
}

/// Gives an idle worker its next case. Returns false if there is none.
bool SweepRunner::dispatch(Worker& worker) {
  Group* group = next_group(worker);
  if (group == nullptr) {
    return false;
  }
  const std::size_t place = group->left.front();
  const SweepCase& item = input_.plan.cases[place];
  CaseJob job;
  job.number = item.number;
  job.scratch = directory_.scratch(item.number);
  job.scene = resolved_yaml(input_.scenes[place]);
  job.inputs = inputs_of(item);
  job.scenes = group->size;
  job.command_line = options_.command_line;
  job.threads = one_at_first_ ? options_.threads : threads_each();
  if (!options_.cards.empty()) {
    job.card = options_.cards[static_cast<std::size_t>(&worker - workers_.data()) % options_.cards.size()];
  }
  if (!worker.process) {
    worker.process = std::make_unique<WorkerProcess>(options_.worker, directory_.file("sweep.log"));
  }
  group->left.pop_front();
  worker.group = group;
  worker.place = place;
  worker.scratch = job.scratch;
  worker.start = Clock::now();
  worker.spent = 0.0;
  worker.expected = 0.0;
  worker.process->send(to_json(job));
  return true;
}

void SweepRunner::receive(Worker& worker, const OnCase& on_case) {
  WorkerProcess::Answer answer = worker.process->receive();
  for (; answer.line && worker.place; answer = worker.process->receive()) {
    CaseAnswer said = answer_from_json(*answer.line);
    if (said.record) {
      finish(worker, std::move(*said.record), on_case);
    } else {
      take_expected(worker, *said.expected);
    }
  }
  if (answer.ended) {
    const std::string how = worker.process->how_it_ended();
    worker.process.reset();
    if (worker.place) {
      if (how.starts_with(fmt::format("signal {} ", SIGXCPU))) {  // of a process that computes one case after another
        throw NoRoomError(fmt::format("case {}: its process reached the limit on processor time (ulimit -t)",
                                      input_.plan.cases[*worker.place].number));
      }
      fail(worker, fmt::format("the process that computed it ended by {}; sweep.log may tell more", how), on_case);
    }
  }
}

/// Of the first such case: no more jobs than there is memory for, each with its share of the threads.
void SweepRunner::take_expected(Worker& worker, const CaseCost& cost) {
  worker.expected = cost.seconds;
  if (one_at_first_) {
    one_at_first_ = false;
    if (cost.available_mib > 0 && cost.memory_mib > 0) {
      jobs_ = std::clamp(static_cast<int>(std::min(cost.available_mib / cost.memory_mib, 1e6)), 1, jobs_);
    }
    if (options_.expected) {
      options_.expected(cost, jobs_);
    }
  }
  worker.process->send(std::to_string(threads_each()));
}

/// Counts the time of a case and ends one that takes too long.
void SweepRunner::limit_time(Worker& worker, Clock::duration passed, const OnCase& on_case) {
  worker.spent += std::chrono::duration<double>(passed).count();
  const double limit = options_.case_seconds > 0.0 ? options_.case_seconds : case_limit(worker.expected, longest_);
  if (worker.spent > limit) {
    worker.process.reset();
    fail(worker,
         fmt::format("took longer than {} s: its process was stopped or did not respond, or the case is larger than "
                     "expected; --case-seconds sets the limit",
                     std::round(10.0 * limit) / 10.0),
         on_case);
  }
}

/// Records the case of a worker whose process is gone.
void SweepRunner::fail(Worker& worker, std::string reason, const OnCase& on_case) {
  const SweepCase& item = input_.plan.cases[*worker.place];
  SweepRecord record;
  record.number = item.number;
  record.inputs = inputs_of(item);
  record.status = "failed";
  record.reason = std::move(reason);
  record.seconds = std::chrono::duration<double>(Clock::now() - worker.start).count();
  record.revision = build_info().revision;
  worker.group = nullptr;
  finish(worker, std::move(record), on_case);
}

void SweepRunner::finish(Worker& worker, SweepRecord record, const OnCase& on_case) {
  if (record.status == kNoRoom) {
    throw NoRoomError(fmt::format("case {}: {}", record.number, record.reason));
  }
  worker.place.reset();
  one_at_first_ = false;
  land(record, worker.scratch);
  ++computed_;
  longest_ = record.status == "ok" ? std::max(longest_, record.seconds) : longest_;
  seconds_sum_ += std::isfinite(record.seconds) ? record.seconds : 0.0;
  const SweepRecord& kept = records_.insert_or_assign(record.number, std::move(record)).first->second;
  write_table_now_and_then();
  if (on_case) {
    on_case(kept, progress());
  }
}

/// A case that cannot be put in its place is recorded as failed instead, unless only room is missing.
void SweepRunner::land(SweepRecord& record, const std::string& scratch) {
  try {
    directory_.land(record, scratch);
  } catch (const NoRoomError&) {
    SweepDirectory::drop(scratch);
    throw;
  } catch (const IoError& error) {  // the folder stays for the next start, which tries again
    record.status = "failed";
    record.reason = error.what();
    record.methods.clear();
    try {
      directory_.land(record, directory_.scratch(record.number));
    } catch (const IoError& again) {
      throw IoError(fmt::format("case {}: {}; finished cases are in {}, the same command continues from there",
                                record.number, again.what(), directory_.path()));
    }
  }
}

SweepProgress SweepRunner::progress() const {
  SweepProgress progress;
  progress.done = static_cast<int>(records_.size());
  progress.failed =
      static_cast<int>(std::ranges::count_if(records_, [](const auto& entry) { return entry.second.status != "ok"; }));
  progress.cases = cases_;
  if (computed_ > 0) {
    progress.seconds_left = seconds_sum_ / computed_ * (cases_ - progress.done) / jobs_;
  }
  return progress;
}

/// As often as takes a twentieth of the time: the table of many cases grows long.
void SweepRunner::write_table_now_and_then() {
  const Clock::time_point start = Clock::now();
  if (start < next_table_) {
    return;
  }
  write_table();
  const Clock::time_point end = Clock::now();
  next_table_ = end + std::max<Clock::duration>(std::chrono::seconds(10), 20 * (end - start));
}

SweepSummary SweepRunner::write_table() const {
  SweepSummary summary = summary_of(input_.plan, cases_, records_);
  if (input_.shard.is_whole()) {
    write_sweep_csv(directory_.file("sweep.csv"), summary);
  }
  return summary;
}

SweepResult SweepRunner::result() const { return {write_table(), computed_, jobs_}; }

/// Every worker of as many as there are jobs gets a case if it has none. Returns false if none has any.
bool SweepRunner::dispatch_all() {
  bool any = false;
  for (Worker& worker : std::span(workers_).first(static_cast<std::size_t>(one_at_first_ ? 1 : jobs_))) {
    any = worker.place || dispatch(worker) || any;
  }
  return any;
}

void SweepRunner::wait_and_receive(const OnCase& on_case) {
  std::vector<pollfd> waiting;
  std::vector<Worker*> owners;
  for (Worker& worker : workers_) {
    if (worker.place) {
      const int rest = worker.process->has_rest() ? POLLOUT : 0;
      waiting.push_back({worker.process->socket(), static_cast<short>(POLLIN | rest), 0});
      owners.push_back(&worker);
    }
  }
  const Clock::time_point start = Clock::now();
  if (poll(waiting.data(), waiting.size(), static_cast<int>(kTick.count())) < 0 && errno != EINTR) {
    throw IoError("a sweep cannot wait for its workers");
  }
  // Longer than it was to wait: this process was stopped itself, its workers with it perhaps.
  const auto passed = std::min<Clock::duration>(Clock::now() - start, 2 * kTick);
  for (std::size_t i = 0; i < waiting.size(); ++i) {
    if ((waiting[i].revents & POLLOUT) != 0) {
      owners[i]->process->send_rest();
    }
    if ((waiting[i].revents & ~POLLOUT) != 0) {
      receive(*owners[i], on_case);
    }
  }
  for (Worker& worker : workers_) {
    if (worker.place) {
      limit_time(worker, passed, on_case);
    }
  }
}

SweepResult SweepRunner::run(const OnCase& on_case) {
  try {
    while (dispatch_all()) {
      wait_and_receive(on_case);
      if (options_.tick) {
        options_.tick();
      }
    }
    return result();
  } catch (const NoRoomError& error) {
    stop_workers();
    throw IoError(fmt::format("{}; {} of {} cases are kept in {}, the same command continues from there", error.what(),
                              records_.size(), cases_, directory_.path()));
  } catch (...) {
    stop_workers();
    throw;
  }
}

/// Drops what they were at.
void SweepRunner::stop_workers() {
  for (Worker& worker : workers_) {
    worker.process.reset();
    if (worker.place) {
      SweepDirectory::drop(worker.scratch);
    }
  }
}

}  // namespace touchfield
