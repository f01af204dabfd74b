#include <algorithm>
#include <cstdio>
#include <memory>
#include <optional>
#include <unistd.h>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "apps/commands/command_line.h"
#include "apps/commands/commands.h"
#include "apps/commands/console_progress.h"
#include "apps/commands/job_console.h"
#include "apps/commands/standard_streams.h"
#include "sim/core/json.h"
#include "sim/core/require.h"
#include "sim/core/text.h"
#include "sim/jobs/check_scene.h"
#include "sim/jobs/sweep.h"
#include "sim/jobs/sweep_case.h"
#include "sim/pictures/plots.h"
#include "sim/run/run_directory.h"
#include "sim/run/text_table.h"

namespace touchfield {

namespace {

struct SweepCommand {
  std::string sweep;
  std::string output;                     // empty: results/runs/NAME_sweep-NNNN
  std::vector<std::string> overrides;     // of every case
  std::string cases;                      // N or FIRST-LAST; empty: all
  bool list = false;                      // compute nothing
  std::string metric = "relative_error";  // of the plot
  SweepOptions options;
};

/// What ends a sweep between two looks at its workers.
struct Interrupted {
  int signal;
};

constexpr const char* kWorkerName = "sweep-worker";

std::optional<CaseRange> range_of(const std::string& text) {
  if (text.empty()) {
    return std::nullopt;
  }
  const auto dash = text.find('-');
  const auto number = [&](std::size_t from, std::size_t to) {
    const auto found = number_of<int>(std::string_view(text).substr(from, to - from));
    require(found.has_value(), "--case {}: must be a number, or FIRST-LAST", text);
    return *found;
  };
  const int first = number(0, dash);
  return CaseRange{first, dash == std::string::npos ? first : number(dash + 1, text.size())};
}

template <typename Inputs>
std::string inputs_text(const Inputs& inputs) {
  std::string text;
  for (const auto& [path, value] : inputs) {
    text += fmt::format("{}{}={}", text.empty() ? "" : " ", path, value);
  }
  return text;
}

/// Says how far the sweep is, and ends it by a signal.
class SweepConsole : public ConsoleProgress {
 public:
  explicit SweepConsole(const CommonFlags& flags)
      : ConsoleProgress(flags), json_(flags.json), terminal_(isatty(fileno(stderr)) == 1) {}

  void advance(double fraction) override {
    if (const int signal = take_interrupt(); signal != 0) {
      throw Interrupted{signal};
    }
    ConsoleProgress::advance(fraction);
  }

  void on_case(const SweepRecord& record, const SweepProgress& progress) {
    if (json_) {
      Json json = json_from_text<Json>(to_json(record, -1));
      json.erase("crc32");  // of the record alone
      json.update({{"event", "case"},
                   {"done", progress.done},
                   {"failed", progress.failed},
                   {"cases", progress.cases},
                   {"seconds_left", progress.seconds_left}});
      put(json_text(json) + "\n");
      std::fflush(stdout);
    }
    const std::string name = fmt::format("case {} ({})", record.number, inputs_text(record.inputs));
    if (record.status != "ok") {
      warn(fmt::format("{} failed: {}", name, record.reason));
    } else {
      const std::string line =
          fmt::format("  {}: {:.1f} s; {} of {} cases", name, record.seconds, progress.done, progress.cases);
      terminal_ ? detail(line) : note(line);
    }
  }

 private:
  bool json_;
  bool terminal_;
};

/// What the command prints at its end, and its exit code.
///
/// whole   all cases, which have a table
int report(const SweepSummary& summary, const std::string& directory, const CommonFlags& flags, int computed,
           bool whole) {
  const auto failed = std::ranges::count(summary.records, "failed", &SweepRecord::status);
  if (flags.json) {
    const Json json = {{"event", "end"},         {"name", summary.name},           {"directory", directory},
                       {"cases", summary.cases}, {"done", summary.records.size()}, {"computed", computed},
                       {"failed", failed}};
    put(json_text(json) + "\n");
  } else {
    put(sweep_table(summary));
    put(fmt::format("{} of {} cases done, {} failed; {}\n", summary.records.size(), summary.cases, failed,
                    whole ? fmt::format("table in {}/sweep.csv", directory) : "in " + directory));
  }
  return failed > 0 ? 1 : 0;
}

std::string output_directory(const SweepCommand& command, const SweepInput& input) {
  if (!command.output.empty()) {
    return command.output;
  }
  require(!command.options.only, "--case needs the sweep's directory: -o DIR");
  return next_directory("results/runs", input.plan.name + "_sweep");
}

/// Every case and what it would take.
int list(const SweepInput& input, const CommonFlags& flags) {
  std::vector<std::vector<std::string>> rows = {{"case", "name", "changes", "seconds", "MiB", "problem"}};
  for (const Json& one : list_cases(input)) {
    if (flags.json) {
      put(json_text(one) + "\n");
      continue;
    }
    const auto number = [&](const char* name, const char* format) {
      return table_number(one.at(name).is_null() ? kNotComputed : one.at(name).get<double>(), format);
    };
    rows.push_back({one.at("case").dump(), one.at("name").get<std::string>(),
                    inputs_text(one.at("inputs").get<std::map<std::string, std::string>>()),
                    number("seconds", "{:.1f}"), number("memory_mib", "{:.0f}"), one.at("reason").get<std::string>()});
  }
  if (!flags.json) {
    put(aligned_table(rows, {1, 2, 5}));
  }
  return 0;
}

int sweep_command(SweepCommand command, const Invocation& invoked) {
  const CommonFlags& flags = invoked.flags;
  require_metric(command.metric);
  SweepOptions& options = command.options;
  options.only = range_of(command.cases);
  if (!command.list) {
    block_interrupts();
  }
  options.threads = apply_threads(flags);
  const SweepInput input = read_sweep_input(command.sweep, command.overrides);
  if (command.list) {
    return list(input, flags);
  }
  require_cases(input, options.only);
  const SweepDirectory directory = SweepDirectory::open(output_directory(command, input), input.plan);
  SweepConsole console(flags);
  options.worker = {"/proc/self/exe", kWorkerName};
  options.command_line = invoked.command_line;
  options.cards = cards_for(input.scenes);
  options.on_case = [&](const SweepRecord& record, const SweepProgress& now) { console.on_case(record, now); };
  console.note(fmt::format("{}: {} cases, {} at a time, in {}", input.plan.name, input.plan.cases.size(), options.jobs,
                           directory.path()));
  console.begin("sweep");
  try {
    const SweepResult result = run_sweep(input, directory, options, console);
    if (!options.only) {
      const std::string why_not =
          draw_sweep(directory.file(fmt::format("sweep_{}.png", command.metric)), result.summary, command.metric);
      if (!why_not.empty()) {
        console.note("no plot: " + why_not);
      }
    }
    return report(result.summary, directory.path(), flags, result.computed, !options.only);
  } catch (const Interrupted& interrupted) {
    say(
        fmt::format("\ntouchfield: interrupted by {}; {} of {} cases are done and kept in {}, unfinished cases were "
                    "dropped; the same command with -o {} continues\n",
                    interrupt_text(interrupted.signal), read_records(directory.path()).whole.size(),
                    input.plan.cases.size(), directory.path(), directory.path()));
    return 128 + interrupted.signal;
  }
}

}  // namespace

void add_sweep_command(CLI::App& app, Invocation& invocation) {
  const auto sweep = std::make_shared<SweepCommand>();
  CLI::App* command = app.add_subcommand("sweep", "Compute many scenes: a base scene with changes");
  command->add_option("SWEEP", sweep->sweep, "Sweep file (YAML)")->type_name(kYamlFile)->required();
  command
      ->add_option("-o,--output", sweep->output,
                   "Output directory; default: results/runs/NAME_sweep-NNNN, the next free number")
      ->type_name(kFolder);
  add_overrides(command, sweep->overrides);
  add_compute_device(command, sweep->overrides);
  add_whole(command, "--jobs", sweep->options.jobs, schema::between(1, kMostThreads),
            "Cases at a time, which share the threads");
  add_number(command, "--case-seconds", sweep->options.case_seconds, schema::above(0),
             "Give up a case that takes longer [s]; default: none")
      ->default_str("");
  command->add_option("--case", sweep->cases, "Compute these cases only, N or FIRST-LAST, without locks");
  command->add_flag("--list", sweep->list, "List the cases with their expected time and memory, and compute nothing");
  command->add_option("--plot", sweep->metric, "Metric of the plot")->capture_default_str();
  finish_command(command, invocation, [sweep](const Invocation& invoked) { return sweep_command(*sweep, invoked); });
  add_hidden_command(app, invocation, kWorkerName, [] { return serve_cases(); });
}

}  // namespace touchfield
