#include <algorithm>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <memory>
#include <new>
#include <sstream>
#include <stdexcept>
#include <string>
#include <string_view>
#include <sys/resource.h>
#include <system_error>
#include <unistd.h>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include "apps/commands/command_line.h"
#include "apps/commands/commands.h"
#include "apps/commands/standard_streams.h"
#include "sim/core/errors.h"
#include "sim/core/program_start.h"
#include "sim/core/version.h"
#include "sim/scene/input.h"
#include "sim/scene/schema_info.h"
#include "solvers/linear/instruction_level.h"

namespace touchfield {

namespace {

constexpr std::size_t kColumns = 80;
constexpr std::size_t kNames = 28;  // columns of names

/// Words in lines that begin at a column; the first one is already there.
std::string wrapped(const std::string& text, std::size_t column) {
  std::istringstream words(text);
  std::string lines;
  std::size_t at = column;
  for (std::string word; words >> word;) {
    if (at > column && at + 1 + word.size() > kColumns) {
      lines += '\n' + std::string(column, ' ');
      at = column;
    }
    lines += (at > column ? " " : "") + word;
    at += word.size() + (at > column ? 1 : 0);
  }
  return lines;
}

std::string row(const std::string& name, const std::string& text) {
  std::string line = "  " + name;
  line += line.size() + 2 > kNames ? '\n' + std::string(kNames, ' ') : std::string(kNames - line.size(), ' ');
  return line + wrapped(text, kNames) + '\n';
}

/// "ENUM:{cm, mm}" as "cm|mm".
std::string value_text(std::string type) {
  if (const std::size_t open = type.find('{'); open != std::string::npos && type.back() == '}') {
    type = type.substr(open + 1, type.size() - open - 2);
    for (std::size_t comma = 0; (comma = type.find(',')) != std::string::npos;) {
      type.replace(comma, type.find_first_not_of(", ", comma) - comma, "|");
    }
  }
  return type;
}

/// Help of commands and options in 80 columns, with the values of an option as a user types them: `--unit mm|cm|m`,
/// `--threads N`.
class HelpFormatter : public CLI::Formatter {
 public:
  std::string make_option(const CLI::Option* option, bool is_positional) const override {
    std::string name = make_option_name(option, is_positional);
    if (!is_positional && !option->get_type_name().empty()) {
      name += ' ' + value_text(option->get_type_name());
      name += option->get_expected_min() > 1 ? fmt::format(" x {}", option->get_expected_min()) : "";
    }
    const std::string preset = option->get_default_str();
    return row(name, option->get_description() + (preset.empty() ? "" : "; default: " + preset));
  }

  std::string make_subcommand(const CLI::App* command) const override {
    return row(command->get_name(), command->get_description());
  }

  std::string make_description(const CLI::App* app) const override {
    std::istringstream lines(app->get_description());
    std::string text;
    for (std::string line; std::getline(lines, line);) {
      text += wrapped(line, 0) + '\n';
    }
    return text;
  }
};

/// The name of a command as it is typed behind the program's.
std::string path_of_command(const CLI::App& command) {
  const CLI::App* parent = command.get_parent();
  if (parent == nullptr) {
    return "";
  }
  const std::string before = path_of_command(*parent);
  return before.empty() ? command.get_name() : before + " " + command.get_name();
}

/// The last command that the line names; the program itself if it names none.
const CLI::App& named_command(const CLI::App& app) {
  const CLI::App* command = &app;
  while (!command->get_subcommands().empty()) {
    command = command->get_subcommands().front();
  }
  return *command;
}

std::vector<std::string> shown_commands(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::App* command : app.get_subcommands([](const CLI::App* any) { return !any->get_group().empty(); })) {
    names.push_back(command->get_name());
  }
  return names;
}

bool is_option(const std::string& word) {
  return word.size() > 1 && word[0] == '-' && word.find_first_of("0123456789.") != 1;
}

/// A long name as the words that suggestions are made of, which end in units.
std::string as_word(std::string_view name) {
  std::string word(name.substr(std::min(name.find_first_not_of('-'), name.size())));
  std::ranges::replace(word, '-', '_');
  return word;
}

/// The name of the option that a misspelt one was probably meant to be; empty if none is near.
std::string meant_option(const CLI::App& command, const std::string& typed) {
  const std::string wanted = as_word(typed);
  std::vector<std::string> words;
  std::vector<std::string> names;
  for (const CLI::Option* option : command.get_options()) {
    for (const std::string& name : option->get_lnames()) {
      words.push_back(as_word(name));
      names.push_back("--" + name);
    }
  }
  const auto begun = [&](const std::string& word) {
    return wanted.size() > 1 &&
           (word.starts_with(wanted) || schema::without_unit(word) == schema::without_unit(wanted));
  };
  auto found = std::ranges::find_if(words, begun);
  if (found == words.end()) {
    found = std::ranges::find(words, schema::nearest_word(words, wanted));
  }
  return found == words.end() ? "" : names[static_cast<std::size_t>(found - words.begin())];
}

std::string unknown_option(const CLI::App& app, const CLI::App& command, const std::string& word) {
  const std::string typed = word.substr(0, word.find('='));
  const std::string path = path_of_command(command);
  if (&command != &app && command.get_option_no_throw(typed) != nullptr) {
    return fmt::format("{} must follow the command: touchfield {} {}", typed, path, typed);
  }
  const std::string shown = schema::quoted_for_message(typed);
  const std::string meant = meant_option(command, typed);
  return meant.empty() ? fmt::format("unknown option {}; `touchfield {}{}--help` lists all options", shown, path,
                                     path.empty() ? "" : " ")
                       : fmt::format("unknown option {}; did you mean {}?", shown, meant);
}

/// Whether `app` has a command of this name, shown by --help or not.
bool is_command(const CLI::App& app, const std::string& word) {
  return !app.get_subcommands([&](const CLI::App* command) { return command->get_name() == word; }).empty();
}

/// What to say of a word that stands where a command of `app` should and is none.
std::string unknown_command(const CLI::App& app, const std::string& word) {
  struct Kind {
    std::vector<std::string_view> endings;
    std::string_view what;
    std::string_view command;
  };
  static const Kind kKinds[] = {{{".yaml", ".yml"}, "to run a scene", "run"},
                                {{".h5"}, "to describe a run", "info"},
                                {{".stl", ".obj", ".ply", ".off", ".glb"}, "to inspect a mesh", "mesh"}};
  const std::string shown = schema::quoted_for_message(word);
  const std::string path = path_of_command(app);
  const std::string ending = std::filesystem::path(word).extension().string();
  for (const Kind& kind : kKinds) {
    if (path.empty() && std::ranges::find(kind.endings, ending) != kind.endings.end()) {
      return fmt::format("unknown command '{}'; {}: touchfield {} {}", shown, kind.what, kind.command, shown);
    }
  }
  const std::vector<std::string> known = shown_commands(app);
  const std::string near = schema::nearest_word(known, word);
  return near.empty() ? fmt::format("unknown command '{}'; the commands are {}", shown, fmt::join(known, ", "))
                      : fmt::format("unknown command '{}'; did you mean {}?", shown, near);
}

/// The error of a command line that could not be parsed, in the parser's words. An unknown command or option is named
/// with the known one that was probably meant.
std::string command_line_problem(const CLI::App& app, const CLI::ParseError& error) {
  const CLI::App& command = named_command(app);
  const std::string path = path_of_command(command);
  const std::vector<std::string> rest = app.remaining(true);
  const bool mismatch = dynamic_cast<const CLI::ArgumentMismatch*>(&error) != nullptr;
  if (const auto option = std::ranges::find_if(rest, is_option); option != rest.end() && !mismatch) {
    return unknown_option(app, command, *option);
  }
  if (!rest.empty() && !mismatch && !shown_commands(command).empty()) {
    return unknown_command(command, rest.front());
  }
  return fmt::format("{}; `touchfield {}{}--help` explains it", error.what(), path, path.empty() ? "" : " ");
}

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

void end_without_room(int /*argc*/, char** /*argv*/, char** environment) {
  const std::string missing = missing_room(environment);
  if (!missing.empty()) {
    const std::string line = "touchfield: error: " + missing + "\n";
    static_cast<void>(!write(STDERR_FILENO, line.data(), line.size()));
    _exit(EXIT_FAILURE);
  }
}

// Before the libraries' own start, in which OpenBLAS would hang.
[[gnu::section(".preinit_array"), gnu::used]] void (*const kFirst)(int, char**, char**) = end_without_room;

/// What the command line asks for, and its exit code.
int run_program(int argc, char** argv) {
  restart_with_better_settings(argv);
  take_time_limit_as_a_signal();
  hold_standard_streams();
  return finish_output(exit_code_of(argc, argv));
}

}  // namespace

}  // namespace touchfield

int main(int argc, char** argv) { return touchfield::run_program(argc, argv); }
