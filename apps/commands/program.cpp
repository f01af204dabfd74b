#include "apps/commands/program.h"

#include <exception>
#include <memory>
#include <new>
#include <sstream>
#include <stdexcept>
#include <string>
#include <sys/resource.h>
#include <system_error>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "apps/commands/command_line.h"
#include "apps/commands/command_line_problem.h"
#include "apps/commands/commands.h"
#include "apps/commands/help_formatter.h"
#include "apps/commands/standard_streams.h"
#include "sim/core/errors.h"
#include "sim/core/program_start.h"
#include "sim/core/version.h"
#include "solvers/linear/instruction_level.h"

namespace touchfield {

namespace {

constexpr int kFailed = 1;
constexpr int kBadInput = 2;
constexpr int kNotBuilt = 3;
constexpr int kDevice = 4;

std::string version_line() {
  const BuildInfo build = build_info();
  return fmt::format("touchfield {} ({})\n{}, {} build, flags {}", build.version, build.revision, build.compiler,
                     build.build_type, build.flags);
}

/// What the command line asks for, run after it has been parsed as a whole.
int dispatch(int argc, char** argv) {
  CLI::App app(
      "Mid-air ultrasound haptics: transducer phases that press a wanted pattern on the skin of a hand.\n"
      "Exit codes: 0 ok, 1 failed, 2 bad input, 3 not built in, 4 device.",
      "touchfield");
  app.set_version_flag("--version", version_line());
  app.require_subcommand(1);
  app.formatter(std::make_shared<HelpFormatter>());
  app.get_formatter()->label("SUBCOMMAND", "COMMAND");
  app.footer(
      "Examples:\n  touchfield init mine\n  touchfield run mine.yaml -o mine\n"
      "`touchfield COMMAND --help` explains a command.");
  Invocation invocation;
  invocation.command_line = joined_command_line(argc, argv);
  add_commands(app, invocation);

  if (argc == 1) {
    put(app.help());
    return 0;
  }
  if (argc > 1 && argv[1][0] != '-' && !is_command(app, argv[1])) {
    throw InputError(unknown_command(app, argv[1]));
  }
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& asked) {  // --help, --version
    std::ostringstream text;
    const int code = app.exit(asked, text, text);
    put(text.str());
    return code;
  } catch (const CLI::ParseError& error) {
    throw InputError(command_line_problem(app, error));
  }
  try {
    return invocation.action();
  } catch (const std::bad_alloc&) {
    // Of a scene's commands its mesh takes most.
    const bool of_scene = app.get_subcommands().front()->get_option_no_throw("--set") != nullptr;
    throw std::runtime_error(out_of_memory() + (of_scene ? "; a larger body.edge_mm needs less" : ""));
  }
}

/// A level that TOUCHFIELD_LEVEL misnames, and variables that libraries crash by, are found before anything is
/// computed.
void check_variables() {
  require_sound_variables();
  try {
    instruction_level();
  } catch (const std::invalid_argument& error) {
    throw InputError(error.what());
  }
}

/// Where the limit on processor time is met the system kills. A second before that it can say so by SIGXCPU.
void take_time_limit_as_a_signal() {
  rlimit time{};
  if (getrlimit(RLIMIT_CPU, &time) == 0 && time.rlim_max != RLIM_INFINITY && time.rlim_max > 1) {
    time.rlim_cur = std::min(time.rlim_cur, time.rlim_max - 1);
    setrlimit(RLIMIT_CPU, &time);
  }
}

int report(const std::string& message, int code) {
  say(fmt::format("touchfield: error: {}\n", message));
  return code;
}

int exit_code_of(int argc, char** argv) {
  try {
    check_variables();
    return dispatch(argc, argv);
  } catch (const InputError& error) {
    return report(error.what(), kBadInput);
  } catch (const NotBuiltError& error) {
    return report(error.what(), kNotBuilt);
  } catch (const DeviceError& error) {
    return report(error.what(), kDevice);
  } catch (const std::bad_alloc&) {
    return report(out_of_memory(), kFailed);
  } catch (const std::system_error& error) {
    const bool thread = error.code() == std::errc::resource_unavailable_try_again;
    return report(thread ? fmt::format("no thread can be started: {}; raise ulimit -u", error.what()) : error.what(),
                  kFailed);
  } catch (const std::exception& error) {
    return report(error.what(), kFailed);
  }
}

}  // namespace

int run_program(int argc, char** argv) {
  restart_with_better_settings(argv);
  take_time_limit_as_a_signal();
  hold_standard_streams();
  return finish_output(exit_code_of(argc, argv));
}

}  // namespace touchfield
