#include "apps/commands/job_console.h"

#include <algorithm>
#include <csignal>
#include <ctime>
#include <filesystem>
#include <set>
#include <system_error>
#include <thread>
#include <unistd.h>
#include <utility>

#include <fmt/format.h>

#include "hardware/stop_signals.h"
#include "sim/core/errors.h"
#include "sim/scene/scene_reader.h"

namespace touchfield {

namespace {

namespace fs = std::filesystem;

fs::path without_links(const std::string& path) {
  std::error_code none;
  const fs::path whole = fs::weakly_canonical(fs::absolute(path, none), none);
  return whole.has_filename() ? whole : whole.parent_path();
}

bool lies_in(const fs::path& path, const fs::path& folder) {
  return std::ranges::mismatch(folder, path).in1 == folder.end();
}

/// Waits beside the caller for a signal that ends it politely, calls `on_interrupt` with its name, and ends the process
/// with 128 + signal. Runs until the process ends.
void handle_interrupts(std::function<void(const char* signal_name)> on_interrupt) {
  std::thread([act = std::move(on_interrupt)] {
    const sigset_t set = StopSignals::polite();
    int signal = 0;
    if (sigwait(&set, &signal) == 0) {
      act(interrupt_text(signal).c_str());
      _exit(128 + signal);
    }
  }).detach();
}

}  // namespace

void require_apart(const std::string& output, const std::vector<std::string>& read) {
  for (const std::string& path : read) {
    const fs::path out = without_links(output);
    const fs::path in = without_links(path);
    std::error_code none;
    if (!output.empty() && (lies_in(in, out) || (fs::is_directory(in, none) && lies_in(out, in)))) {
      throw InputError(fmt::format("-o {}: must be another directory, apart from {}, which is read", output, path));
    }
  }
}

void require_apart(const std::string& output, const std::string& scene_file, const Scene& scene) {
  require_apart(output, read_by(scene_file, scene));
}

std::vector<std::string> read_by(const std::string& scene_file, const Scene& scene) {
  const std::set<std::string> named = named_files(scene);
  std::vector<std::string> read(named.begin(), named.end());
  if (!scene_file.empty()) {
    read.push_back(scene_file);
  }
  if (scene.motion) {
    if (const auto* recorded = std::get_if<RecordedSpec>(&scene.motion->sensor.sight)) {
      read.push_back(recorded->folder);
    } else if (const auto* joints = std::get_if<JointsSpec>(&scene.motion->sensor.sight)) {
      if (const auto* file = std::get_if<std::string>(&joints->from)) {
        read.push_back(*file);
      }
    }
  }
  return read;
}

void block_interrupts() {
  const sigset_t set = StopSignals::polite();
  pthread_sigmask(SIG_BLOCK, &set, nullptr);
}

int take_interrupt() {
  const sigset_t set = StopSignals::polite();
  const timespec at_once{};
  return std::max(0, sigtimedwait(&set, nullptr, &at_once));
}

std::string interrupt_text(int signal) {
  return StopSignals::name(signal) + (signal == SIGXCPU ? ", the limit on processor time (ulimit -t)" : "");
}

void add_output(CLI::App* command, JobOutput& output, const std::string& what, const std::string& replaces) {
  command->add_option("-o,--output", output.directory, what)->type_name(kFolder);
  command->add_flag("--force", output.force, replaces);
}

JobConsole::JobConsole(const Invocation& invoked, const std::string& kept)
    : invoked_(invoked), progress_(invoked.flags) {
  block_interrupts();
  handle_interrupts([open = open_, kept](const char* signal_name) {
    const std::lock_guard lock(open->mutex);
    if (!open->directory) {
      say(fmt::format("\ntouchfield: interrupted by {} before anything was written\n", signal_name));
    } else if (open->directory->fail(fmt::format("interrupted by {}", signal_name))) {
      say(fmt::format("\ntouchfield: interrupted by {}; {}\n", signal_name,
                      fmt::format(fmt::runtime(kept), open->directory->file("failed.json"))));
    } else {
      say(fmt::format("\ntouchfield: interrupted by {} after all was written\n", signal_name));
    }
  });
  threads_ = apply_threads(invoked.flags);
}

RunDirectory& JobConsole::claim(const JobOutput& output, const std::string& name,
                                const std::vector<std::string>& files) {
  const std::lock_guard lock(open_->mutex);
  open_->directory.emplace(RunDirectory::at(
      output.directory.empty() ? next_directory("results/runs", name) : output.directory, files, output.force));
  return *open_->directory;
}

void JobConsole::say_results(const RunDirectory& directory, const std::string& makes,
                             const std::vector<std::string>& files) {
  progress_.note(fmt::format("{} in {}", makes, directory.path()));
  for (const std::string& file : files) {
    if (file == "report.html" || file.starts_with("overview.")) {
      progress_.note(fmt::format("open {}", directory.file(file)));
    }
  }
}

}  // namespace touchfield
