#pragma once

#include <functional>
#include <map>
#include <string>
#include <type_traits>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "sim/core/json.h"
#include "sim/core/program_start.h"
#include "sim/scene/quantity.h"

namespace touchfield {

struct CommonFlags {
  int threads = 0;       // 0: as many as the machine offers (or OMP_NUM_THREADS)
  bool quiet = false;    // errors and results only
  bool verbose = false;  // how each stage is solved too
  bool json = false;     // results as JSON on standard output
};

/// Prints what a command has to say, as JSON or as text; with --quiet no text, unless it is a result.
void print_value(const Json& value, const CommonFlags& flags, bool is_result = false);

/// What a command line asks for.
struct Invocation {
  CommonFlags flags;
  std::string command_line;     // as it was typed, for provenance
  std::function<int()> action;  // of the command that was named: prints results on standard output and returns the exit
                                // code; errors are thrown
};

/// Lets a command take the common flags, and act once the whole line has been parsed and names it.
void finish_command(CLI::App* command, Invocation& invocation, std::function<int(const Invocation&)> action);

/// A command without options that this program gives itself and --help does not show.
void add_hidden_command(CLI::App& app, Invocation& invocation, const std::string& name, std::function<int()> action);

/// Type names of values that are files, for help.
inline constexpr const char* kYamlFile = "YAML";
inline constexpr const char* kH5File = "H5";
inline constexpr const char* kMeshFile = "MESH";
inline constexpr const char* kAnyFile = "FILE";
inline constexpr const char* kFolder = "FOLDER";

/// SCENE and --set.
void add_scene(CLI::App* command, std::string& scene, std::vector<std::string>& overrides);
/// --set alone.
void add_overrides(CLI::App* command, std::vector<std::string>& overrides);

/// --device: what computes, in place of the scene's solve.device.
void add_compute_device(CLI::App* command, std::vector<std::string>& overrides);

/// An option with a number, decimal and finite, within `range` in the unit that it is typed in; kept times `unit`. Help
/// shows its bounds. All options with numbers are made by these functions, so that each refuses in the same words:
/// "--edge-mm 0.01 must be 0.4 to 8".
/// throws   InputError while the line is parsed
CLI::Option* add_checked(CLI::App* command, const std::string& name, const schema::Range& range, bool whole,
                         const std::string& what, const std::function<void(double)>& keep);
template <class Value>  // double, or an optional one
CLI::Option* add_number(CLI::App* command, const std::string& name, Value& value, const schema::Range& range,
                        const std::string& what, double unit = 1) {
  CLI::Option* option =
      add_checked(command, name, range, false, what, [&value, unit](double number) { value = number * unit; });
  if constexpr (std::is_same_v<Value, double>) {
    option->default_str(fmt::format("{:g}", value / unit));
  }
  return option;
}
/// The same of a whole number.
template <class Value>  // int, or an optional one
CLI::Option* add_whole(CLI::App* command, const std::string& name, Value& value, const schema::Range& range,
                       const std::string& what) {
  return add_checked(command, name, range, true, what, [&value](double number) { value = static_cast<int>(number); });
}
/// The same of a list; how many they are is set at the option.
CLI::Option* add_numbers(CLI::App* command, const std::string& name, std::vector<double>& values,
                         const schema::Range& range, const std::string& what, double unit = 1);

/// One of several words; an error lists them.
CLI::Validator one_of(const std::vector<std::string>& words);

/// A choice of an enumerator by its name; help and errors list the names, not the numbers behind them.
template <typename Enum>
CLI::Validator named(const std::map<std::string, Enum>& values) {
  std::vector<std::string> words;
  for (const auto& [name, value] : values) {
    words.push_back(name);
  }
  CLI::Validator known = one_of(words);
  return {[values, known](std::string& input) {
            std::string problem = known(input);
            if (problem.empty()) {
              input = std::to_string(static_cast<int>(values.at(input)));
            }
            return problem;
          },
          known.get_description()};
}

/// Sets the number of threads of our loops and of OpenBLAS; returns the number in use.
int apply_threads(const CommonFlags& flags);

/// Keeps freed memory instead of giving it back to the system. Taking the matrices of each frame again, page by page,
/// costs a quarter of a frame on 16 cores.
void keep_freed_memory();

/// The first line of a log: which program computes the scene, and by what on this machine.
std::string first_log_line(const std::string& scene, int threads);

/// require_free for a file that a command writes.
///
/// read     files that the command reads
/// throws   also if it is one of these, by whatever name
void require_free_output(const std::string& path, bool force, const std::vector<std::string>& read = {});

/// The command as it was typed, quoted for a shell.
/// throws   InputError on a word that is not UTF-8 text (sim/core/text.h)
std::string joined_command_line(int argc, char** argv);

}  // namespace touchfield
