#pragma once

#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "apps/commands/command_line.h"
#include "apps/commands/console_progress.h"
#include "apps/commands/standard_streams.h"
#include "sim/run/job.h"
#include "sim/scene/scene.h"

namespace touchfield {

/// Results never take the place of what they are made of.
///
/// output   of a command; empty: a new directory, which is always another one
/// read     files and folders that it reads
/// throws   InputError if one of them lies in the output, or the output in a folder that is read
void require_apart(const std::string& output, const std::vector<std::string>& read);
/// The same of what a scene reads.
void require_apart(const std::string& output, const std::string& scene_file, const Scene& scene);

/// What a scene reads: its file unless that is "", the files that it names and the folder of recorded images.
std::vector<std::string> read_by(const std::string& scene_file, const Scene& scene);

/// Signals are held back, for take_interrupt or a thread of their own. Before the first thread starts.
void block_interrupts();

/// The signal that has come since then and that nobody has taken, SIGINT, SIGTERM, SIGHUP or SIGXCPU; 0: none.
int take_interrupt();

/// Its name, and of SIGXCPU what it stands for.
std::string interrupt_text(int signal);

/// Where a command's job writes: -o and --force.
struct JobOutput {
  std::string directory;  // empty: results/runs/NAME-NNNN
  bool force = false;
};

/// what, replaces   for help
void add_output(CLI::App* command, JobOutput& output,
                const std::string& what = "Output directory; default: results/runs/NAME-NNNN, the next free number",
                const std::string& replaces = "Replace the run that the output directory holds");

/// The console of a command that does a job. An interrupt closes the directory as well. A thread of this object takes
/// the signals, so that a long factorisation does not delay them. So the object must be made before any other thread.
class JobConsole {
 public:
  /// kept   what an interrupt says of what is already written, after "interrupted by SIGINT; "; {} stands for
  ///        failed.json
  JobConsole(const Invocation& invoked, const std::string& kept);

  ConsoleProgress& progress() { return progress_; }
  int threads() const { return threads_; }

  /// Does the job in its output directory and prints what came of it. What it throws is recorded there and thrown on.
  ///
  /// begin     says what is known before, once there is a log
  /// returns   the exit code
  /// throws    as RunDirectory and the job
  template <class Result>
  int finish(const JobOutput& output, const Job<Result>& job, const std::function<void()>& begin = {}) {
    RunDirectory& directory = claim(output, job.name, job.files);
    const auto compute = [&](RunDirectory& own, Progress& progress) {
      progress_.log_to(own.file(job.files.front()));
      if (begin) {
        begin();
      }
      return job.compute(own, progress);
    };
    const Result result = filled(directory, progress_, compute);
    const Json value = job.value(result, directory.path());
    const bool has_text = job.print && !invoked_.flags.json;
    say_results(directory, job.makes, job.files);
    has_text ? put(job.print(result, value, invoked_.flags.quiet)) : print_value(value, invoked_.flags, true);
    return 0;
  }

 private:
  struct Open {
    std::mutex mutex;
    std::optional<RunDirectory> directory;
  };

  RunDirectory& claim(const JobOutput& output, const std::string& name, const std::vector<std::string>& files);
  void say_results(const RunDirectory& directory, const std::string& makes, const std::vector<std::string>& files);

  std::shared_ptr<Open> open_ = std::make_shared<Open>();
  const Invocation& invoked_;
  int threads_ = 0;
  ConsoleProgress progress_;
};

}  // namespace touchfield
