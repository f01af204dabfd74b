#include "sim/run/sweep.h"

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <deque>
#include <filesystem>
#include <iostream>
#include <poll.h>
#include <unistd.h>
#include <utility>

#include <fmt/format.h>
#include <omp.h>

#include "sim/core/errors.h"
#include "sim/core/text_hash.h"
#include "sim/core/version.h"
#include "sim/run/file_progress.h"
#include "sim/run/provenance.h"
#include "sim/run/sweep_case.h"
#include "sim/run/worker_process.h"
#include "sim/scene/scene_reader.h"

namespace touchfield {

namespace {

using Clock = std::chrono::steady_clock;

SweepSummary summary_of(const SweepIdentity& identity) {
  SweepSummary summary;
  summary.name = identity.name;
  summary.text = identity.text;
  summary.base = identity.base;
  summary.hash = identity.hash;
  summary.parameters = identity.parameters;
  return summary;
}

std::vector<SweepRecord> values(const std::map<int, SweepRecord>& records) {
  std::vector<SweepRecord> list;
  list.reserve(records.size());
  for (const auto& [number, record] : records) {
    list.push_back(record);
  }
  return list;
}

}  // namespace

/// Cases that share a body.
struct SweepRunner::Group {
  std::deque<std::size_t> left;  // places in the plan
  int size = 0;                  // of all cases of the plan, so that a resumed sweep chooses its solvers alike
};

struct SweepRunner::Worker {
  std::optional<WorkerProcess> process;
  Group* group = nullptr;            // of its last case, whose models it keeps
  std::optional<std::size_t> place;  // of the case it is at
  std::string scratch;
  Clock::time_point start;
};

SweepRunner::SweepRunner(const SweepPlan& plan, const std::vector<Scene>& scenes, const SweepIdentity& identity,
                         SweepDirectory& directory, SweepOptions options)
    : plan_(plan),
      scenes_(scenes),
      directory_(directory),
      options_(std::move(options)),
      summary_(summary_of(identity)),
      records_(directory.records()),
      next_table_(Clock::now()) {
  summary_.provenance = provenance_now(options_.threads, "", options_.command_line, identity.hash);
  if (options_.retry_failed) {
    std::erase_if(records_, [](const auto& entry) { return entry.second.status != "ok"; });
  }
  const std::vector<int> numbers = body_groups(scenes);
  groups_.resize(numbers.empty() ? 0 : 1 + static_cast<std::size_t>(*std::ranges::max_element(numbers)));
  for (std::size_t i = 0; i < plan.cases.size(); ++i) {
    Group& group = groups_[static_cast<std::size_t>(numbers[i])];
    ++group.size;
    if (identity.shard.has(plan.cases[i].number)) {
      ++cases_;
      if (!records_.contains(plan.cases[i].number)) {
        group.left.push_back(i);
      }
    }
  }
  summary_.cases = cases_;
  const auto open = std::ranges::count_if(groups_, [](const Group& group) { return !group.left.empty(); });
  jobs_ = options_.jobs > 0 ? options_.jobs : std::min(options_.threads, static_cast<int>(open));
  jobs_ = std::clamp(jobs_, 1, std::max(1, left()));
  workers_.resize(static_cast<std::size_t>(jobs_));
}

SweepRunner::~SweepRunner() = default;

std::size_t SweepRunner::groups() const { return groups_.size(); }

void SweepRunner::limit_jobs(double case_mib, double available_mib) {
  if (available_mib > 0 && case_mib > 0) {
    jobs_ = std::clamp(static_cast<int>(std::min(available_mib / case_mib, 1e6)), 1, jobs_);
    workers_.resize(static_cast<std::size_t>(jobs_));
  }
}

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
  const SweepCase& item = plan_.cases[place];
  CaseJob job;
  job.number = item.number;
  job.scratch = directory_.scratch(item.number);
  job.scene = resolved_yaml(scenes_[place]);
  for (const SceneChange& change : item.changes) {
    job.inputs.emplace_back(change.path, change.value);
  }
  job.scenes = group->size;
  job.command_line = options_.command_line;
  job.threads = std::max(1, options_.threads / jobs_);
  if (!worker.process) {
    worker.process.emplace(options_.worker, directory_.file("sweep.log"));
  }
  group->left.pop_front();
  worker.group = group;
  worker.place = place;
  worker.scratch = job.scratch;
  worker.start = Clock::now();
  worker.process->send(to_json(job));  // one that has ended meanwhile is met when its answer is read
  return true;
}

void SweepRunner::receive(Worker& worker, const OnCase& on_case) {
  const WorkerProcess::Answer answer = worker.process->receive();
  if (answer.line && worker.place) {
    finish(worker, record_from_json(*answer.line, "answer of a worker"), on_case);
  } else if (answer.ended) {
    const std::string how = worker.process->how_it_ended();
    worker.process.reset();
    worker.group = nullptr;
    if (worker.place) {
      const SweepCase& item = plan_.cases[*worker.place];
      SweepRecord record;
      record.number = item.number;
      for (const SceneChange& change : item.changes) {
        record.inputs.emplace_back(change.path, change.value);
      }
      record.status = "failed";
      record.reason = fmt::format("the process that computed it ended by {}; sweep.log may tell more", how);
      record.seconds = std::chrono::duration<double>(Clock::now() - worker.start).count();
      record.revision = summary_.provenance.revision;
      finish(worker, std::move(record), on_case);
    }
  }
}

void SweepRunner::finish(Worker& worker, SweepRecord record, const OnCase& on_case) {
  worker.place.reset();
  land(record, worker.scratch);
  ++computed_;
  seconds_sum_ += std::isfinite(record.seconds) ? record.seconds : 0.0;
  const SweepRecord& kept = records_.insert_or_assign(record.number, std::move(record)).first->second;
  write_table_now_and_then();
  if (on_case) {
    on_case(kept, progress());
  }
}

/// A case that cannot be put in its place is recorded as failed instead.
void SweepRunner::land(SweepRecord& record, const std::string& scratch) {
  try {
    directory_.land(record, scratch);
  } catch (const IoError& error) {
    SweepDirectory::drop(scratch);
    record.status = "failed";
    record.reason = error.what();
    record.methods.clear();
    try {
      directory_.land(record, directory_.scratch(record.number));
    } catch (const IoError& again) {
      throw IoError(fmt::format("case {}: {}; what has finished is in {}, --resume goes on from there", record.number,
                                again.what(), directory_.path()));
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
  summary_.records = values(records_);
  write_sweep_tables(directory_.path(), summary_);
  const Clock::time_point end = Clock::now();
  next_table_ = end + std::max<Clock::duration>(std::chrono::seconds(10), 20 * (end - start));
}

SweepResult SweepRunner::result() {
  SweepResult result;
  summary_.records = values(records_);
  summary_.provenance.end = utc_now();
  write_sweep_tables(directory_.path(), summary_);
  result.summary = summary_;
  result.computed = computed_;
  result.failed = progress().failed;
  result.jobs = jobs_;
  return result;
}

SweepResult SweepRunner::run(const OnCase& on_case) {
  while (true) {
    std::vector<pollfd> waiting;
    std::vector<Worker*> owners;
    {
      const std::lock_guard lock(mutex_);
      for (Worker& worker : workers_) {
        if (worker.place || dispatch(worker)) {
          waiting.push_back({worker.process->answers(), POLLIN, 0});
          owners.push_back(&worker);
        }
      }
      if (waiting.empty()) {
        return result();
      }
    }
    if (poll(waiting.data(), waiting.size(), -1) < 0 && errno != EINTR) {
      throw IoError("a sweep cannot wait for its workers");
    }
    const std::lock_guard lock(mutex_);
    for (std::size_t i = 0; i < waiting.size(); ++i) {
      if (waiting[i].revents != 0) {
        receive(*owners[i], on_case);
      }
    }
  }
}

SweepResult SweepRunner::interrupt() {
  mutex_.lock();  // for good: run() must not go on
  for (Worker& worker : workers_) {
    if (worker.process) {
      worker.process->kill();
      worker.process->how_it_ended();
    }
    if (worker.place) {
      SweepDirectory::drop(worker.scratch);
    }
  }
  return result();
}

int serve_cases() {
  // Whatever a library prints must not end up among the answers.
  FILE* answers = fdopen(dup(STDOUT_FILENO), "w");
  dup2(STDERR_FILENO, STDOUT_FILENO);
  if (answers == nullptr) {
    throw IoError("the answers cannot be written");
  }
  KeptWork kept;
  std::string line;
  while (std::getline(std::cin, line)) {
    const CaseJob job = job_from_json(line);
    omp_set_num_threads(job.threads);
    FileProgress progress(job.scratch + "/run.log");
    const SweepRecord record = run_case(job, kept, progress);
    fmt::print(answers, "{}", to_json(record, -1));
    std::fflush(answers);
  }
  std::fclose(answers);
  return 0;
}

SweepSummary collect_sweep(const std::string& directory) {
  std::vector<std::string> parts = shard_directories(directory);
  if (std::filesystem::exists(directory + "/sweep.json")) {
    parts.insert(parts.begin(), directory);
  }
  if (parts.empty()) {
    throw InputError(fmt::format("{} holds no sweep and no shard of one", directory));
  }
  const SweepIdentity first = read_identity(parts.front());
  SweepSummary summary = summary_of(first);
  summary.cases = static_cast<int>(first.cases.size());
  std::map<int, SweepRecord> records;
  for (const std::string& part : parts) {
    const SweepIdentity identity = read_identity(part);
    if (identity.hash != first.hash) {
      throw InputError(fmt::format("{} and {} are of different sweeps", parts.front(), part));
    }
    records.merge(read_records(part));
  }
  summary.records = values(records);
  summary.provenance = provenance_now({}, "", "", first.hash);
  return summary;
}

void write_sweep_tables(const std::string& directory, const SweepSummary& summary) {
  write_sweep_csv(directory + "/sweep.csv", summary);
  write_sweep_h5(directory + "/sweep.h5", summary);
}

}  // namespace touchfield
