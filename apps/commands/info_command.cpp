#include <filesystem>
#include <memory>

#include <fmt/format.h>

#include "apps/commands/command_line.h"
#include "apps/commands/commands.h"
#include "apps/commands/console_progress.h"
#include "apps/commands/standard_streams.h"
#include "sim/run/archive_file.h"
#include "sim/run/motion_file.h"
#include "sim/run/motion_summary.h"
#include "sim/run/run_directory.h"
#include "sim/run/run_file.h"
#include "sim/run/run_text.h"

namespace touchfield {

namespace {

/// As JSON with every metric of every method.
std::string json_of(Json value, const Json& methods) {
  value["methods"] = methods;
  return json_text(value, 2) + '\n';
}

int info_command(const std::string& path, const CommonFlags& flags) {
  std::string file = result_file_at(path);
  if (const std::string unfinished = unfinished_run(path); !unfinished.empty()) {
    ConsoleProgress(flags).warn(fmt::format("unfinished: {} holds a run that has not ended", unfinished));
    file = std::filesystem::exists(file) ? file : result_file_at(unfinished);
  }
  if (archive_format(file) == kMotionArchive.name()) {
    const Motion motion = read_motion_file(file, say_warning);
    put(flags.json ? json_of(motion_value(motion), method_values(motion)) : describe_motion(motion));
  } else {
    const Run run = read_run_file(file, say_warning);
    put(flags.json ? json_of(run_value(run), method_values(run)) : describe_run(run));
  }
  return 0;
}

}  // namespace

void add_info_command(CLI::App& app, Invocation& invocation) {
  const auto path = std::make_shared<std::string>();
  CLI::App* command = app.add_subcommand("info", "Describe a run.h5, a motion.h5 or a pattern.h5");
  command->add_option("RUN", *path, "run.h5, motion.h5 or pattern.h5, or the directory that holds it")
      ->required()
      ->type_name(kH5File);
  finish_command(command, invocation, [path](const Invocation& invoked) { return info_command(*path, invoked.flags); });
}

}  // namespace touchfield
