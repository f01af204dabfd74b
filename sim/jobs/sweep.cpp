#include "sim/jobs/sweep.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <fcntl.h>
#include <filesystem>
#include <iterator>
#include <map>
#include <memory>
#include <poll.h>
#include <ranges>
#include <set>
#include <sys/socket.h>
#include <system_error>
#include <unistd.h>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "sim/core/errors.h"
#include "sim/core/files.h"
#include "sim/core/program_start.h"
#include "sim/core/require.h"
#include "sim/core/version.h"
#include "sim/gpu/gpu_library.h"
#include "sim/jobs/sweep_case.h"
#include "sim/model/meshed_body.h"
#include "sim/model/model.h"
#include "sim/run/methods.h"
#include "sim/scene/scene_reader.h"

namespace touchfield {

namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kTick{500};  // other processes' cases and the limit of time are looked at so often

/// What a case changes, as its record keeps it.
std::vector<std::pair<std::string, std::string>> inputs_of(const SweepCase& item) {
  std::vector<std::pair<std::string, std::string>> inputs;
  for (const SceneChange& change : item.changes) {
    inputs.emplace_back(change.path, change.value);
  }
  return inputs;
}

/// Reads every file that the scenes of a sweep name, each once, without building their models. Meshes are read as
/// bodies. Runs that a method starts from are compared with the channels of the array. (Files of positions and phases
/// are read with the scene.)
///
/// throws   InputError with the first problems, one line per problem: the number of the first case that has it, and
///          the problem
void require_named_files(const std::vector<Scene>& scenes) {
  constexpr int kMostProblems = 20;
  std::set<std::string> done;
  std::vector<std::string> problems;
  const auto once = [&](std::size_t place, const std::string& key, const auto& check) {
    if (!done.insert(key).second || problems.size() == kMostProblems) {
      return;
    }
    try {
      check();
    } catch (const InputError& error) {
      problems.push_back(fmt::format("case {}: {}", place + 1, error.what()));
    }
  };
  for (std::size_t i = 0; i < scenes.size(); ++i) {
    for (const BodySpec& body : scenes[i].bodies) {
      if (std::holds_alternative<MeshShape>(body.shape)) {
        once(i, shape_text(body), [&] { require_body(body); });
      }
    }
    const Eigen::Index channels = channel_count(scenes[i].array);
    for (const MethodSpec& method : scenes[i].solve.methods) {
      once(i,
           fmt::format("{} {} {} {} {} {}", method.name, method.start.file, method.start.method, method.phases.size(),
                       method.amplitudes.size(), channels),
           [&] { require_fitting_phases(method, channels); });
    }
  }
  require(problems.empty(), "{}", fmt::join(problems, "\n"));
}

class SweepRun {
 public:
  SweepRun(const SweepInput& input, const SweepDirectory& directory, const SweepOptions& options, Progress& progress);

  void compute();
  SweepResult result() const { return {table(), computed_}; }
  /// Drops the cases under way, and writes the table of those that are finished.
  void stop();
  /// The table of what there is, which it writes unless some cases alone are asked for.
  SweepSummary table() const;
  std::string kept_text() const;

 private:
  enum class State { kOpen, kHere, kDone };

  struct Case {
    const SweepCase* item;
    const Scene* scene;
    int group;
    State state = State::kOpen;
  };

  struct Worker {
    std::unique_ptr<WorkerProcess> process;
    std::size_t next = 0;  // where it looks for its next case
    Case* at = nullptr;    // the one it is at
    std::optional<FileLock> lock{};
    std::string scratch{};
    double spent = 0.0;  // on it, while this process ran too [s]
  };

  void take_record(Case& one, SweepRecord record);
  bool take(Case& one, std::optional<FileLock>& lock);
  void dispatch(Worker& worker);
  void receive(Worker& worker);
  void finish(Worker& worker);
  static SweepRecord failure(const Worker& worker, const std::string& reason);
  void fail(Worker& worker, const std::string& reason);
  void limit_time(Worker& worker, Clock::duration passed);
  void wait();
  bool is_complete() const { return records_.size() == cases_.size(); }

  const SweepInput& input_;
  const SweepDirectory& directory_;
  const SweepOptions& options_;
  Progress& progress_;
  std::vector<Case> cases_;     // that are asked for, those of a body together
  std::map<int, int> sharing_;  // cases of each group, of the whole plan
  std::map<int, SweepRecord> records_;
  std::vector<Worker> workers_;
  std::size_t done_before_ = 0;
  int computed_ = 0;
  Clock::time_point start_ = Clock::now();
  Clock::time_point next_table_ = start_;
};

SweepRun::SweepRun(const SweepInput& input, const SweepDirectory& directory, const SweepOptions& options,
                   Progress& progress)
    : input_(input), directory_(directory), options_(options), progress_(progress) {
  const CaseRecords found = read_records(directory.path());
  if (!options.only) {
    directory.clear_leftovers(found.whole);
  }
  const std::vector<int> groups = body_groups(input.scenes);
  for (std::size_t i = 0; i < groups.size(); ++i) {
    const int number = input.plan.cases[i].number;
    ++sharing_[groups[i]];
    if (options.only && (number < options.only->first || number > options.only->last)) {
      continue;
    }
    Case& one = cases_.emplace_back(Case{&input.plan.cases[i], &input.scenes[i], groups[i]});
    if (const auto there = found.whole.find(number);
        there != found.whole.end() && (!options.only || there->second.status == "ok")) {
      take_record(one, there->second);
    }
    if (const auto there = found.damaged.find(number); there != found.damaged.end()) {
      progress.warn(fmt::format("case {} is damaged and computed again: {}", number, there->second));
    }
  }
  done_before_ = records_.size();
  std::ranges::stable_sort(cases_, {}, &Case::group);
  const auto jobs = static_cast<std::size_t>(std::max(1, options.jobs));
  for (std::size_t i = 0; i < jobs; ++i) {
    workers_.push_back({nullptr, i * cases_.size() / jobs});
  }
}

void SweepRun::take_record(Case& one, SweepRecord record) {
  one.state = State::kDone;
  records_.insert_or_assign(one.item->number, std::move(record));
}

/// Makes a case one of this process. False if another has it, or has finished it.
bool SweepRun::take(Case& one, std::optional<FileLock>& lock) {
  if (!options_.only) {
    lock = directory_.lock(one.item->number);
    if (!lock) {
      return false;
    }
    std::optional<SweepRecord> meanwhile;
    try {
      meanwhile = directory_.record(one.item->number);
    } catch (const Error&) {  // NOLINT(bugprone-empty-catch): it is damaged
    }
    if (meanwhile) {
      take_record(one, std::move(*meanwhile));
      directory_.unlock(one.item->number, lock);
      return false;
    }
  }
  one.state = State::kHere;
  return true;
}

/// Gives an idle worker its next case, if there is one.
void SweepRun::dispatch(Worker& worker) {
  for (std::size_t tried = 0; tried < cases_.size() && worker.at == nullptr; ++tried) {
    Case& one = cases_[worker.next];
    worker.next = (worker.next + 1) % cases_.size();
    worker.at = one.state == State::kOpen && take(one, worker.lock) ? &one : nullptr;
  }
  if (worker.at == nullptr) {
    return;
  }
  const int number = worker.at->item->number;
  worker.scratch = directory_.scratch(number, !options_.only);
  worker.spent = 0.0;
  CaseJob job{number,
              resolved_yaml(*worker.at->scene),
              inputs_of(*worker.at->item),
              sharing_.at(worker.at->group),
              options_.command_line,
              std::max(1, options_.threads / static_cast<int>(workers_.size())),
              ""};
  if (!options_.cards.empty()) {
    job.card = options_.cards[static_cast<std::size_t>(&worker - workers_.data()) % options_.cards.size()];
  }
  write_job(job, worker.scratch);
  if (!worker.process) {
    worker.process = std::make_unique<WorkerProcess>(options_.worker, directory_.file("sweep.log"));
  }
  worker.process->send(worker.scratch);
}

void SweepRun::receive(Worker& worker) {
  const WorkerProcess::Answer answer = worker.process->receive();
  if (answer.line == kCaseDone) {
    finish(worker);
  } else if (answer.line) {
    throw IoError(fmt::format("case {}: {}", worker.at->item->number, *answer.line));
  } else if (answer.ended) {
    const std::string how = worker.process->how_it_ended();
    worker.process.reset();
    require_io(!how.starts_with(fmt::format("signal {} ", SIGXCPU)),
               fmt::format(  // of a process that computes many cases
                   "case {}: its process reached the limit on processor time (ulimit -t)", worker.at->item->number));
    fail(worker, fmt::format("the process that computed it ended by {}; sweep.log may tell more", how));
  }
}

/// Its record stands in its scratch folder.
void SweepRun::finish(Worker& worker) {
  Case& one = *worker.at;
  const int number = one.item->number;
  const std::string in_the_way = directory_.land(number, worker.scratch);
  std::optional<SweepRecord> record =
      in_the_way.empty() ? directory_.record(number) : std::optional(failure(worker, in_the_way));
  require_io(record.has_value(), fmt::format("case {}: its folder was removed", number));
  worker.at = nullptr;
  ++computed_;
  take_record(one, *record);
  if (!is_complete() && !options_.only && Clock::now() >= next_table_) {  // while nobody else can think it complete
    const Clock::time_point begin = Clock::now();
    table();
    next_table_ = Clock::now() + std::max<Clock::duration>(std::chrono::minutes(1), 20 * (Clock::now() - begin));
  }
  if (worker.lock) {
    directory_.unlock(number, worker.lock);
  }
  if (options_.on_case) {
    const auto failed = std::ranges::count_if(records_, [](const auto& done) { return done.second.status != "ok"; });
    const std::chrono::duration<double> passed = Clock::now() - start_;
    const auto left = static_cast<double>(cases_.size() - records_.size());
    options_.on_case(*record,
                     {static_cast<int>(records_.size()), static_cast<int>(failed), static_cast<int>(cases_.size()),
                      left * passed.count() / static_cast<double>(records_.size() - done_before_)});
  }
}

SweepRecord SweepRun::failure(const Worker& worker, const std::string& reason) {
  SweepRecord record;
  record.number = worker.at->item->number;
  record.inputs = inputs_of(*worker.at->item);
  record.status = "failed";
  record.reason = reason;
  record.seconds = worker.spent;
  record.revision = build_info().revision;
  return record;
}

void SweepRun::fail(Worker& worker, const std::string& reason) {
  write_record(failure(worker, reason), worker.scratch);
  finish(worker);
}

/// Counts the time of a case and ends one that takes too long.
void SweepRun::limit_time(Worker& worker, Clock::duration passed) {
  worker.spent += std::chrono::duration<double>(passed).count();
  if (options_.case_seconds > 0.0 && worker.spent > options_.case_seconds) {
    worker.process.reset();
    fail(worker, fmt::format("took longer than {:g} s (--case-seconds)", options_.case_seconds));
  }
}

void SweepRun::wait() {
  std::vector<pollfd> waiting;
  std::vector<Worker*> owners;
  for (Worker& worker : workers_) {
    if (worker.at != nullptr) {
      waiting.push_back({worker.process->socket(), POLLIN, 0});
      owners.push_back(&worker);
    }
  }
  const Clock::time_point begin = Clock::now();
  require_io(poll(waiting.data(), waiting.size(), static_cast<int>(kTick.count())) >= 0 || errno == EINTR,
             "a sweep cannot wait for its workers");
  // Longer than it was to wait: this process was stopped itself, its workers with it perhaps.
  const auto passed = std::min<Clock::duration>(Clock::now() - begin, 2 * kTick);
  for (std::size_t i = 0; i < waiting.size(); ++i) {
    if (waiting[i].revents != 0) {
      receive(*owners[i]);
    } else {
      limit_time(*owners[i], passed);
    }
  }
}

void SweepRun::compute() {
  while (!is_complete()) {
    for (Worker& worker : workers_) {
      if (worker.at == nullptr) {
        dispatch(worker);
      }
    }
    if (!is_complete()) {  // others may have finished what was left
      wait();
    }
    progress_.advance(static_cast<double>(records_.size() - done_before_) /
                      static_cast<double>(cases_.size() - done_before_));
  }
  if (!options_.only) {
    directory_.clear_leftovers(records_);
  }
}

void SweepRun::stop() {
  for (Worker& worker : workers_) {
    worker.process.reset();
    if (worker.at != nullptr) {
      std::error_code error;
      std::filesystem::remove_all(worker.scratch, error);
      worker.lock.reset();
    }
  }
  try {
    if (computed_ > 0) {
      table();
    }
  } catch (const IoError&) {  // NOLINT(bugprone-empty-catch): there is no room; the same command writes it
  }
}

SweepSummary SweepRun::table() const {
  SweepSummary summary{input_.plan.name, static_cast<int>(cases_.size()), input_.plan.parameters, {}};
  const auto there = is_complete() || options_.only ? records_ : read_records(directory_.path()).whole;
  std::ranges::copy(there | std::views::values, std::back_inserter(summary.records));
  if (!options_.only) {
    write_sweep_csv(directory_.file("sweep.csv"), summary);
  }
  return summary;
}

std::string SweepRun::kept_text() const {
  return fmt::format("{} of {} cases are kept in {}, the same command continues from there", records_.size(),
                     cases_.size(), directory_.path());
}

[[noreturn]] void fail(const char* what) {
  throw IoError(fmt::format("a worker process cannot be started: {}: {}", what, std::system_category().message(errno)));
}

/// In the child, between fork and exec: only calls that are safe there.
[[noreturn]] void become(char* const* arguments, int socket, int log, pid_t parent) {
  setpgid(0, 0);
  die_with(parent);
  restore_processors();
  sigset_t none;
  sigemptyset(&none);
  sigprocmask(SIG_SETMASK, &none, nullptr);
  dup2(socket, STDIN_FILENO);
  dup2(socket, STDOUT_FILENO);
  dup2(log, STDERR_FILENO);
  execv(arguments[0], arguments);
  _exit(127);
}

}  // namespace

SweepInput read_sweep_input(const std::string& path, const std::vector<std::string>& overrides) {
  SweepInput input{read_sweep(path, overrides), {}};
  input.scenes = read_cases(input.plan);
  require_named_files(input.scenes);
  input.plan.hash = plan_hash(input.plan, input.scenes);
  return input;
}

std::vector<std::string> cards_for(const std::vector<Scene>& scenes) {
  const auto all_ask = [&](const auto& what) {
    return std::ranges::all_of(scenes, [&](const Scene& scene) { return what(scene.solve.solver.device); });
  };
  const bool free = all_ask([](const ComputeDevice& device) { return device.kind == ComputeDevice::Kind::kAuto; }) ||
                    all_ask([](const ComputeDevice& device) {
                      return device.kind == ComputeDevice::Kind::kCuda && device.card == 0;
                    });
  return free ? separate_cards() : std::vector<std::string>();
}

void require_cases(const SweepInput& input, const std::optional<CaseRange>& only) {
  if (only) {
    require(only->first >= 1 && only->first <= only->last &&
                static_cast<std::size_t>(only->last) <= input.plan.cases.size(),
            "case {}-{}: the sweep has cases 1 to {}", only->first, only->last, input.plan.cases.size());
  }
}

SweepResult run_sweep(const SweepInput& input, const SweepDirectory& directory, const SweepOptions& options,
                      Progress& progress) {
  require_cases(input, options.only);
  SweepRun run(input, directory, options, progress);
  try {
    run.compute();
    return run.result();
  } catch (const IoError& error) {
    run.stop();
    throw IoError(fmt::format("{}; {}", error.what(), run.kept_text()));
  } catch (...) {
    run.stop();
    throw;
  }
}

WorkerProcess::WorkerProcess(std::vector<std::string> arguments, const std::string& log) {
  SocketPair ends;
  const Descriptor errors(open(log.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC, 0644));
  if (errors.number() < 0) {
    fail(log.c_str());
  }
  std::vector<char*> pointers;
  std::ranges::transform(arguments, std::back_inserter(pointers), [](std::string& word) { return word.data(); });
  pointers.push_back(nullptr);
  for (const char* name : {"OMP_PROC_BIND", "OMP_PLACES", "GOMP_CPU_AFFINITY"}) {
    unsetenv(name);  // each worker would be bound to the first processors
  }
  const pid_t parent = getpid();
  pid_ = fork();
  if (pid_ < 0) {
    fail("fork");
  }
  if (pid_ == 0) {
    become(pointers.data(), ends.others.number(), errors.number(), parent);
  }
  socket_ = std::move(ends.own);
}

WorkerProcess::~WorkerProcess() {
  if (pid_ > 0) {
    ::kill(pid_, SIGKILL);
    wait_for(pid_);
  }
}

void WorkerProcess::send(const std::string& line) {
  const std::string text = line + "\n";
  ::send(socket_.number(), text.data(), text.size(), MSG_NOSIGNAL);
}

WorkerProcess::Answer WorkerProcess::receive() {
  std::array<char, 4096> bytes;
  const ssize_t count = ::recv(socket_.number(), bytes.data(), bytes.size(), MSG_DONTWAIT);
  if (count <= 0) {
    return {std::nullopt, count == 0 || (errno != EAGAIN && errno != EWOULDBLOCK && errno != EINTR)};
  }
  buffer_.append(bytes.data(), static_cast<std::size_t>(count));
  if (!buffer_.ends_with('\n')) {
    return {};
  }
  buffer_.pop_back();
  return {std::exchange(buffer_, {})};
}

std::string WorkerProcess::how_it_ended() { return end_text(wait_for(std::exchange(pid_, -1))); }

}  // namespace touchfield
