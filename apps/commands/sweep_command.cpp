#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <unistd.h>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "apps/commands/command_line.h"
#include "apps/commands/commands.h"
#include "apps/commands/console_progress.h"
#include "apps/commands/interrupt_guard.h"
#include "apps/commands/standard_streams.h"
#include "sim/batch/run_directory.h"
#include "sim/batch/sweep.h"
#include "sim/batch/sweep_case.h"
#include "sim/batch/sweep_list.h"
#include "sim/core/errors.h"
#include "sim/core/json_text.h"
#include "sim/core/text_number.h"
#include "sim/pictures/sweep_picture.h"
#include "sim/store/text_table.h"

namespace touchfield {

namespace {

struct SweepCommand {
  std::string sweep;
  std::string output;                  // empty: results/runs/NAME_sweep-NNNN
  std::vector<std::string> overrides;  // of every case
  std::string collect;                 // directory to collect instead; then `sweep` is empty
  std::string shard = "1/1";
  std::optional<int> case_number;         // one case alone
  bool list = false;                      // compute nothing
  std::string metric = "relative_error";  // of the plot
  PictureFormat pictures = PictureFormat::kPng;
  SweepOptions options;
};

/// What ends a sweep between two looks at its workers.
struct Interrupted {
  int signal;
};

constexpr const char* kWorkerName = "sweep-worker";

using Json = nlohmann::ordered_json;

Shard shard_of(const std::string& text) {
  const auto slash = text.find('/');
  const auto number = [&](std::size_t from, std::size_t to) {
    return number_of<int>(std::string_view(text).substr(from, to - from)).value_or(0);
  };
  const Shard shard =
      slash == std::string::npos ? Shard{0, 0} : Shard{number(0, slash), number(slash + 1, text.size())};
  if (shard.count < 1 || shard.index < 1 || shard.index > shard.count) {
    throw InputError(fmt::format("--shard {}: must be i/n with 1 <= i <= n", text));
  }
  return shard;
}

template <typename Inputs>
std::string inputs_text(const Inputs& inputs) {
  std::string text;
  for (const auto& [path, value] : inputs) {
    text += fmt::format("{}{}={}", text.empty() ? "" : " ", path, value);
  }
  return text;
}

Json record_json(const SweepRecord& record, const SweepProgress& progress) {
  Json json = json_from_text<Json>(to_json(record, -1));
  json.erase("crc32");  // of the record alone
  json["event"] = "case";
  json["done"] = progress.done;
  json["failed"] = progress.failed;
  json["cases"] = progress.cases;
  json["seconds_left"] = progress.seconds_left;
  return json;
}

/// Says how far the sweep is: on a terminal in one line, elsewhere a line a case; or as JSON lines.
class Reporter {
 public:
  explicit Reporter(const CommonFlags& flags)
      : json_(flags.json), quiet_(flags.quiet || flags.json), terminal_(isatty(fileno(stderr)) == 1) {}

  void note(const std::string& line) const {
    if (!quiet_) {
      say(fmt::format("{}\n", line));
    }
  }

  static void warn(const std::string& line) { say(fmt::format("touchfield: warning: {}\n", line)); }

  void on_case(const SweepRecord& record, const SweepProgress& progress) const {
    if (json_) {
      put(json_text(record_json(record, progress)) + "\n");
      std::fflush(stdout);
    }
    const bool failed = record.status != "ok";
    if (quiet_ && !failed) {
      return;
    }
    if (terminal_ && !quiet_) {
      clear_line();
    }
    if (failed) {
      say(fmt::format("touchfield: case {} ({}) failed: {}\n", record.number, inputs_text(record.inputs),
                      record.reason));
    }
    const std::string count = fmt::format("{} of {} cases{}, {} left", progress.done, progress.cases,
                                          progress.failed > 0 ? fmt::format(", {} failed", progress.failed) : "",
                                          progress.seconds_left >= 0 ? span_text(progress.seconds_left) : "?");
    if (!quiet_ && terminal_) {
      say(fmt::format("  {}{}", count, progress.done == progress.cases ? "\n" : ""));
    } else if (!quiet_ && !failed) {
      say(fmt::format(
          "  case {} ({}): {:.1f} s{}; {}\n", record.number, inputs_text(record.inputs), record.seconds,
          record.models > 0 ? fmt::format(", {} of {} models used again", record.models_reused, record.models) : "",
          count));
    }
  }

 private:
  bool json_;
  bool quiet_;
  bool terminal_;
};

void draw(const std::string& directory, const SweepSummary& summary, const SweepCommand& command,
          const Reporter& reporter) {
  const SweepPlot plot =
      draw_sweep(fmt::format("{}/sweep_{}.{}", directory, command.metric, to_string(command.pictures)), summary,
                 command.metric, command.pictures);
  if (!plot) {
    reporter.note("no plot: " + plot.why_not);
  }
}

/// What the command prints at its end, and its exit code.
///
/// whole   all cases, which have a table
int report(const SweepSummary& summary, const std::string& directory, const CommonFlags& flags, int computed,
           bool whole = true) {
  const auto failed = std::ranges::count(summary.records, "failed", &SweepRecord::status);
  const auto missing = summary.cases - static_cast<int>(summary.records.size());
  const std::string place = whole ? fmt::format("table in {}/sweep.csv", directory) : "in " + directory;
  if (flags.json) {
    const Json json = {{"event", "end"},
                       {"name", summary.name},
                       {"directory", directory},
                       {"cases", summary.cases},
                       {"done", summary.records.size()},
                       {"computed", computed},
                       {"failed", failed},
                       {"missing", missing}};
    put(json_text(json) + "\n");
  } else {
    put(sweep_table(summary));
    put(fmt::format("{} of {} cases done, {} failed{}; {}\n", summary.records.size(), summary.cases, failed,
                    missing > 0 ? fmt::format(", {} missing", missing) : "", place));
  }
  return failed > 0 || missing > 0 ? 1 : 0;
}

int collect(const SweepCommand& command, const CommonFlags& flags) {
  std::optional<OwnDirectory> own;
  if (std::error_code error; std::filesystem::is_directory(command.collect, error)) {
    own.emplace(own_sweep_directory(command.collect));
  }
  const SweepCollection found = collect_sweep(command.collect);
  for (const std::string& gap : found.gaps) {
    Reporter::warn(gap);
  }
  write_sweep_csv(command.collect + "/sweep.csv", found.summary);
  draw(command.collect, found.summary, command, Reporter(flags));
  return report(found.summary, command.collect, flags, 0);
}

std::string output_directory(const SweepCommand& command, const SweepInput& input) {
  if (!command.output.empty()) {
    return command.output;
  }
  if (command.options.retry_failed || command.case_number || !input.shard.is_whole()) {
    throw InputError("--retry-failed, --shard and --case need the sweep's directory: -o DIR");
  }
  return next_directory("results/runs", input.plan.name + "_sweep");
}

SweepInput read_input(const SweepCommand& command) {
  SweepInput input = read_sweep_input(command.sweep, command.overrides, shard_of(command.shard));
  if (command.case_number) {
    input.shard = case_shard(*command.case_number, input.plan.cases.size());
  }
  return input;
}

/// Every case and what it would take.
int list(const SweepInput& input, const CommonFlags& flags) {
  std::vector<std::vector<std::string>> rows = {{"case", "name", "changes", "seconds", "MiB", "problem"}};
  for (const ListedCase& listed : list_cases(input)) {
    if (flags.json) {
      put(json_text(case_value(listed)) + "\n");
      continue;
    }
    const bool known = listed.reason.empty();
    rows.push_back({fmt::format("{}", listed.item.number), listed.name, inputs_text(listed.item.changes),
                    known ? fmt::format("{:.1f}", listed.cost.seconds) : "-",
                    known ? fmt::format("{:.0f}", listed.cost.memory_mib) : "-", listed.reason});
  }
  if (!flags.json) {
    put(aligned_table(rows, {1, 2, 5}));
  }
  return 0;
}

int sweep_command(const SweepCommand& command, const Invocation& invoked) {
  if (command.sweep.empty() && command.collect.empty()) {
    throw InputError("sweep: SWEEP is missing: a sweep file, or --collect DIR");
  }
  const CommonFlags& flags = invoked.flags;
  require_metric(command.metric);
  if (!command.collect.empty()) {
    return collect(command, flags);
  }
  if (!command.list) {
    block_interrupts();
  }
  const int threads = apply_threads(flags);
  const Reporter reporter(flags);
  const SweepInput input = read_input(command);
  if (command.list) {
    return list(input, flags);
  }
  SweepDirectory directory = input.open(output_directory(command, input));
  SweepOptions options = command.options;
  options.worker = {"/proc/self/exe", kWorkerName};
  options.threads = threads;
  options.command_line = invoked.command_line;
  share_cards(input.scenes, options);
  options.tick = [] {
    if (const int signal = take_interrupt(); signal != 0) {
      throw Interrupted{signal};
    }
  };
  int most = 1;
  options.expected = [&](const CaseCost& cost, int jobs) {
    reporter.note(fmt::format("a case: {} faces, {} channels, about {:.0f} MiB and, on its own, {:.0f} s{}", cost.faces,
                              cost.channels, cost.memory_mib, cost.seconds,
                              jobs < most ? fmt::format("; there is memory for {} at a time", jobs) : ""));
  };
  SweepRunner runner(input, directory, options);
  most = runner.jobs();
  for (const auto& [number, damage] : runner.damaged()) {
    Reporter::warn(fmt::format("case {} is damaged and computed again: {}", number, damage));
  }
  reporter.note(fmt::format("{}: {} cases to compute, {} {}; {} at a time with {} thread{} each, in {}",
                            input.plan.name, runner.left(), runner.groups(), runner.groups() == 1 ? "body" : "bodies",
                            runner.jobs(), runner.threads_each(), runner.threads_each() > 1 ? "s" : "",
                            directory.path()));
  SweepResult result;
  try {
    result = runner.run(
        [&](const SweepRecord& record, const SweepProgress& progress) { reporter.on_case(record, progress); });
  } catch (const Interrupted& interrupted) {
    const SweepSummary kept = runner.result().summary;
    say(fmt::format(
        "\ntouchfield: interrupted by {}; {} of {} cases are done and kept in {}, unfinished cases were "
        "dropped; the same command with -o {} continues\n",
        interrupt_text(interrupted.signal), kept.records.size(), kept.cases, directory.path(), directory.path()));
    return 128 + interrupted.signal;
  }
  if (input.shard.is_whole()) {
    draw(directory.path(), result.summary, command, reporter);
  }
  return report(result.summary, directory.path(), flags, result.computed, input.shard.is_whole());
}

}  // namespace

void add_sweep_command(CLI::App& app, Invocation& invocation) {
  const auto sweep = std::make_shared<SweepCommand>();
  CLI::App* command = app.add_subcommand("sweep", "Compute many scenes: a base scene with changes");
  auto* file = command->add_option("SWEEP", sweep->sweep, "Sweep file (YAML)")->type_name(kYamlFile);
  command
      ->add_option("-o,--output", sweep->output,
                   "Output directory; default: results/runs/NAME_sweep-NNNN, the next free number")
      ->type_name(kFolder);
  add_overrides(command, sweep->overrides);
  add_compute_device(command, sweep->overrides);
  add_whole(command, "--jobs", sweep->options.jobs, schema::between(1, kMostThreads),
            "Cases at a time; default: one per body, at most one per thread");
  add_number(command, "--case-seconds", sweep->options.case_seconds, schema::above(0),
             "Give up a case that takes longer [s]; default: 600 and 20 times the expected time, or 10 times the "
             "longest case so far")
      ->default_str("");
  auto* shard = command->add_option("--shard", sweep->shard, "Compute part i of n only: i/n")->capture_default_str();
  add_whole(command, "--case", sweep->case_number, schema::between(1, kMostCases), "Compute this case only")
      ->excludes(shard);
  command->add_flag("--list", sweep->list, "List the cases with their expected time and memory, and compute nothing");
  command->add_flag("--resume")->group("");  // of scripts for version 0.2: a sweep always continues
  command->add_flag("--retry-failed", sweep->options.retry_failed, "Compute failed cases again");
  command->add_option("--plot", sweep->metric, "Metric of the plot")->capture_default_str();
  add_pictures(command, sweep->pictures, "Format of the plot; default: png");
  command->add_option("--collect", sweep->collect, "Only write the table of a directory")
      ->excludes(file)
      ->type_name(kFolder);
  finish_command(command, invocation, [sweep](const Invocation& invoked) { return sweep_command(*sweep, invoked); });
  add_hidden_command(app, invocation, kWorkerName, [] { return serve_cases(); });
}

}  // namespace touchfield
