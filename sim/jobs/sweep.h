#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "sim/core/child_process.h"
#include "sim/core/progress.h"
#include "sim/jobs/sweep_directory.h"

namespace touchfield {

/// A sweep file as it was read, whole: its plan and the scenes of all its cases.
struct SweepInput {
  SweepPlan plan;
  std::vector<Scene> scenes;
};

/// overrides   as of read_sweep
/// throws      InputError as read_sweep, read_cases and require_named_files
SweepInput read_sweep_input(const std::string& path, const std::vector<std::string>& overrides);

/// The cases from one number to another.
struct CaseRange {
  int first = 1;
  int last = 1;
};

/// How far a sweep is.
struct SweepProgress {
  int done = 0;    // cases with a record, whoever computed them
  int failed = 0;  // of these
  int cases = 0;   // that are asked for
  double seconds_left = kNotComputed;
};

struct SweepOptions {
  std::vector<std::string> worker;   // program and arguments of a process that computes cases: see serve_cases
  int threads = 1;                   // of all jobs together
  int jobs = 1;                      // cases at a time
  double case_seconds = 0.0;         // a case that takes longer is given up as failed [s]; 0: none is
  std::optional<CaseRange> only{};   // these, without locks: nobody else may compute them
  std::vector<std::string> cards{};  // as CUDA_VISIBLE_DEVICES names them, one per worker in turn; empty: as it is
  std::string command_line{};
  std::function<void(const SweepRecord&, const SweepProgress&)> on_case{};  // called for each case computed here
};

/// A card to each worker where the scenes leave open which computes.
std::vector<std::string> cards_for(const std::vector<Scene>& scenes);

struct SweepResult {
  SweepSummary summary;
  int computed = 0;  // by this call
};

/// throws   InputError if the sweep lacks one of these cases
void require_cases(const SweepInput& input, const std::optional<CaseRange>& only);

/// Computes the cases of a sweep that are not there, or damaged, in worker processes. Several processes, on several
/// machines, may do so in one directory at a time: each takes a case by its lock. Cases that others have locked are
/// waited for, and computed here if the others end without them. So the sweep is complete when this returns.
///
/// A worker begins with cases of other bodies than the others, and continues with those that share its last one's body.
/// So mesh and factorisation are used again. A worker that dies, or takes longer than options.case_seconds, takes only
/// its case with it. A damaged case that cannot be replaced counts as failed, too. Time in which this process itself
/// does not run does not count.
///
/// Of options.only those that have failed are computed again. The table is written at the end, and once a minute or
/// less often; not of options.only.
///
/// progress   is told of damaged cases and of the share that is done, twice a second or more often; what it throws ends
///            the sweep
/// throws     InputError as require_cases, and where the file system has no locks; IoError if there is no room for a
///            case, or if it cannot be kept. What has landed stays, cases under way are dropped
SweepResult run_sweep(const SweepInput& input, const SweepDirectory& directory, const SweepOptions& options,
                      Progress& progress);

/// A child process that answers each line that it is given by one line. It dies with its parent, however that ends, and
/// does not get the terminal's interrupts.
class WorkerProcess {
 public:
  /// arguments   program and its arguments
  /// log         file that its standard error is appended to
  /// throws      IoError naming the system's reason
  WorkerProcess(std::vector<std::string> arguments, const std::string& log);
  WorkerProcess(const WorkerProcess&) = delete;
  WorkerProcess& operator=(const WorkerProcess&) = delete;
  /// Kills it if it still runs.
  ~WorkerProcess();

  /// The descriptor to wait for with poll(): readable once there is an answer or the process has ended.
  int socket() const { return socket_.number(); }

  /// Sends a line of at most 64 KiB, once the last one is answered. A process that has ended is met when its answer is
  /// read.
  void send(const std::string& line);

  struct Answer {
    std::optional<std::string> line;  // nothing yet if empty and not ended
    bool ended = false;
  };
  /// Reads what is there without waiting; to be called again until there is a line.
  Answer receive();

  /// Waits for the end of a process that has closed its answers, and says how it ended: end_text.
  std::string how_it_ended();

 private:
  Descriptor socket_;
  pid_t pid_ = -1;
  std::string buffer_;  // a part of an answer
};

}  // namespace touchfield
