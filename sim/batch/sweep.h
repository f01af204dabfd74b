#pragma once

#include <chrono>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "sim/batch/sweep_case.h"
#include "sim/batch/sweep_directory.h"

namespace touchfield {

/// Part i of n of a sweep: the cases whose number is i modulo n. Several processes may compute parts at a time, on
/// several machines.
struct Shard {
  int index = 1;  // from 1
  int count = 1;

  bool has(int number) const { return (number - index) % count == 0; }
  bool is_whole() const { return count == 1; }
};

/// A sweep file as it was read, whole: its plan and the scenes of all its cases; and what is to be computed of it.
struct SweepInput {
  SweepIdentity plan;
  std::vector<Scene> scenes;
  Shard shard{};

  /// throws   as of SweepDirectory
  SweepDirectory open(const std::string& path) const { return SweepDirectory::open(path, plan, !shard.is_whole()); }
};

/// overrides   as of read_sweep
/// throws      InputError as read_sweep, read_cases and require_named_files
SweepInput read_sweep_input(const std::string& path, const std::vector<std::string>& overrides, Shard shard = {});

/// The shard of a case alone.
/// throws   InputError if there is no such case
Shard case_shard(int number, std::size_t cases);

struct SweepOptions {
  std::vector<std::string> worker;  // program and arguments of a process that computes cases: see serve_cases
  int threads = 1;                  // of all jobs together
  int jobs = 0;                     // cases at a time; 0: chosen
  std::vector<std::string> cards;   // as CUDA_VISIBLE_DEVICES names them, one per worker in turn; empty: as it is
  bool retry_failed = false;
  std::function<void(const CaseCost&, int)> expected{};  // called once: what a case takes, and jobs by its memory
  std::function<void()> tick{};  // called twice a second or more often; what it throws ends the sweep
  double case_seconds = 0.0;     // a case that takes longer is given up as failed [s]; 0: case_limit
  std::string command_line;
};

/// A card to each worker where the scenes leave open which computes; one job a card where they all ask for the first.
void share_cards(const std::vector<Scene>& scenes, SweepOptions& options);

/// How long a case may take that nobody has limited: max(600 s + 20 expected, 10 longest) [s]. Estimates hold within a
/// factor of two where nothing else runs.
///
/// expected   as check_model says of this very case; 0 before its model stands
/// longest    of the cases that the runner has computed
double case_limit(double expected, double longest);

/// How far a sweep is.
struct SweepProgress {
  int done = 0;    // cases with a record, whenever they were computed
  int failed = 0;  // of these
  int cases = 0;   // of the shard
  double seconds_left = kNotComputed;
};

struct SweepResult {
  SweepSummary summary;
  int computed = 0;  // by this call
  int jobs = 1;
};

/// Computes the cases of a sweep that have no record yet, each in a worker process, several at a time. A process
/// continues with cases that share its last one's body while there are any. So mesh and factorisation are used again.
/// Cases of other bodies go to other processes.
///
/// A process that dies takes only its case with it. A process that is stopped or stuck is killed once its case has
/// taken longer than options.case_seconds. Without that option the limit is case_limit. Time in which this process
/// itself does not run does not count.
///
/// Without options.jobs there are as many jobs as bodies, at most one per thread. The threads are shared out evenly.
/// The first case begins alone, with all threads, until it has reported the memory that a case takes. There are no more
/// jobs than fit into memory.
class SweepRunner {
 public:
  using OnCase = std::function<void(const SweepRecord&, const SweepProgress&)>;

  /// input       outlives the runner
  /// directory   of its plan; outlives the runner
  SweepRunner(const SweepInput& input, SweepDirectory& directory, SweepOptions options);
  SweepRunner(const SweepInput&&, SweepDirectory&, SweepOptions) = delete;
  SweepRunner(const SweepRunner&) = delete;
  SweepRunner& operator=(const SweepRunner&) = delete;
  ~SweepRunner();

  int jobs() const { return jobs_; }
  int threads_each() const;  // of that many jobs
  /// Groups of cases that share a body, and cases left to compute.
  std::size_t groups() const;
  int left() const;
  /// Cases that are there and damaged, which are computed again, and what is wrong with each.
  const std::map<int, std::string>& damaged() const { return damaged_; }

  /// throws   IoError if there is no room for a case, or if it can be neither kept nor recorded as failed; what tick()
  ///          throws. What has landed stays, cases under way are dropped, and what has not landed is still to be
  ///          computed
  SweepResult run(const OnCase& on_case);

  /// What has landed, of which it writes the table unless it computes a part: after run() has thrown.
  SweepResult result() const;

 private:
  struct Group;
  struct Worker;

  Group* next_group(const Worker& worker);
  bool dispatch(Worker& worker);
  void receive(Worker& worker, const OnCase& on_case);
  void take_expected(Worker& worker, const CaseCost& cost);
  void finish(Worker& worker, SweepRecord record, const OnCase& on_case);
  void fail(Worker& worker, std::string reason, const OnCase& on_case);
  void limit_time(Worker& worker, std::chrono::steady_clock::duration passed, const OnCase& on_case);
  void wait_and_receive(const OnCase& on_case);
  bool dispatch_all();
  void stop_workers();
  void land(SweepRecord& record, const std::string& scratch);
  SweepProgress progress() const;
  SweepSummary write_table() const;
  void write_table_now_and_then();

  const SweepInput& input_;
  SweepDirectory& directory_;
  SweepOptions options_;
  std::map<int, SweepRecord> records_;
  std::map<int, std::string> damaged_;
  std::vector<Group> groups_;
  std::vector<Worker> workers_;
  int jobs_ = 1;
  bool one_at_first_ = true;  // until a case has said what it takes, or could not
  int cases_ = 0;             // of the shard
  int computed_ = 0;
  double seconds_sum_ = 0.0;  // of the cases computed
  double longest_ = 0.0;      // of them, those that are ok [s]
  std::chrono::steady_clock::time_point next_table_;
};

}  // namespace touchfield
