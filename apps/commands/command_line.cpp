#include "apps/commands/command_line.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <malloc.h>
#include <utility>

#include <fmt/ranges.h>
#include <omp.h>

#include "apps/commands/standard_streams.h"
#include "sim/core/errors.h"
#include "sim/core/files.h"
#include "sim/core/require.h"
#include "sim/core/text.h"
#include "sim/core/version.h"
#include "sim/gpu/compute_device.h"
#include "sim/run/text_table.h"
#include "sim/scene/input.h"
#include "sim/scene/schema_info.h"
#include "solvers/linear/instruction_level.h"

namespace touchfield {

namespace {

/// A word as a shell reads it back.
std::string quoted_word(const std::string& word) {
  if (!word.empty() && word.find_first_of(" \t\n'\"\\$*?[]{}()<>|&;#~`!") == std::string::npos) {
    return word;
  }
  std::string quoted;
  for (const char c : word) {
    quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
  }
  return "'" + quoted + "'";
}

/// What a number of the command line must be.
struct NumberRule {
  std::string name;  // of the option
  schema::Range range;
  bool whole = false;

  std::string kind() const { return whole ? "N" : "X"; }

  /// What help says of it.
  std::string described(const std::string& what) const {
    const std::string bounds = range.text();
    return bounds.empty() ? what : fmt::format("{}; {}", what, bounds);
  }

  double operator()(const std::string& text) const {
    const auto number = schema::parse_decimal(text);
    const std::string bounds = range.text();
    std::optional<std::string> rule;
    if (!number || (whole && *number != std::floor(*number))) {
      rule = (whole ? "a whole number" : "a number") + (bounds.empty() ? "" : ", " + bounds);
    } else {
      rule = range.broken_by(*number);
    }
    if (rule) {
      throw InputError(
          fmt::format("{} {} must be {}", name, text.empty() ? "\"\"" : schema::quoted_for_message(text), *rule));
    }
    return *number + 0.0;  // -0 is 0
  }
};

}  // namespace

void finish_command(CLI::App* command, Invocation& invocation, std::function<int(const Invocation&)> action) {
  CommonFlags& flags = invocation.flags;
  add_whole(command, "--threads", flags.threads, schema::between(1, kMostThreads),
            "Number of threads; default: all cores, or OMP_NUM_THREADS");
  command->add_flag("--quiet", flags.quiet, "Show results, warnings and errors only");
  command->add_flag("-v,--verbose", flags.verbose, "Show each stage and how it is solved, as run.log has it");
  command->add_flag("--json", flags.json, "Print results as JSON");
  command->callback([&invocation, action = std::move(action)] {
    invocation.action = [&invocation, action] { return action(invocation); };
  });
}

void add_hidden_command(CLI::App& app, Invocation& invocation, const std::string& name, std::function<int()> action) {
  app.add_subcommand(name)->group("")->callback(
      [&invocation, action = std::move(action)] { invocation.action = action; });
}

void add_overrides(CLI::App* command, std::vector<std::string>& overrides) {
  command->add_option("--set", overrides, "Change a key of the scene: key.path=value, value in YAML; may be repeated")
      ->take_all()
      ->expected(1)
      ->allow_extra_args(false);  // the word behind the value is the scene
}

void add_compute_device(CLI::App* command, std::vector<std::string>& overrides) {
  command
      ->add_option_function<std::string>(
          "--device",
          [&overrides](const std::string& device) {
            if (!compute_device(device)) {
              throw InputError(
                  fmt::format("--device {}: must be auto, cpu, cuda or cuda:N", schema::quoted_for_message(device)));
            }
            overrides.push_back("solve.device=" + device);
          },
          "Device that computes, instead of the scene's solve.device")
      ->type_name("auto|cpu|cuda|cuda:N");
}

void add_scene(CLI::App* command, std::string& scene, std::vector<std::string>& overrides) {
  command->add_option("SCENE", scene, "Scene file (YAML), or the name of a shipped scene")
      ->required()
      ->type_name(kYamlFile);
  add_overrides(command, overrides);
}

CLI::Option* add_checked(CLI::App* command, const std::string& name, const schema::Range& range, bool whole,
                         const std::string& what, const std::function<void(double)>& keep) {
  const NumberRule rule{name, range, whole};
  return command
      ->add_option_function<std::string>(
          name, [rule, keep](const std::string& text) { keep(rule(text)); }, rule.described(what))
      ->type_name(rule.kind());
}

CLI::Option* add_numbers(CLI::App* command, const std::string& name, std::vector<double>& values,
                         const schema::Range& range, const std::string& what, double unit) {
  const NumberRule rule{name, range};
  std::vector<std::string> defaults;
  for (const double value : values) {
    defaults.push_back(fmt::format("{:g}", value / unit));
  }
  return command
      ->add_option_function<std::vector<std::string>>(
          name,
          [rule, &values, unit](const std::vector<std::string>& texts) {
            values.clear();
            for (const std::string& text : texts) {
              values.push_back(rule(text) * unit);
            }
          },
          rule.described(what))
      ->type_name(rule.kind())
      ->default_str(fmt::format("{}", fmt::join(defaults, " ")));
}

CLI::Validator one_of(const std::vector<std::string>& words) {
  return {[words](std::string& input) {
            if (std::ranges::find(words, input) != words.end()) {
              return std::string();
            }
            const std::string near = schema::nearest_word(words, input);
            return fmt::format("{} must be one of {}{}", schema::quoted_for_message(input), fmt::join(words, ", "),
                               near.empty() ? "" : fmt::format("; did you mean {}?", near));
          },
          fmt::format("{{{}}}", fmt::join(words, ", "))};
}

int apply_threads(const CommonFlags& flags) {
  if (flags.threads > 0) {
    omp_set_num_threads(flags.threads);  // the OpenMP flavour of OpenBLAS follows
  }
  take_blas_buffers(omp_get_max_threads());
  return omp_get_max_threads();
}

void keep_freed_memory() {
  mallopt(M_MMAP_THRESHOLD, 1 << 30);
  mallopt(M_TRIM_THRESHOLD, -1);  // never
}

std::string first_log_line(const std::string& scene, int threads) {
  const BuildInfo build = build_info();
  return fmt::format("touchfield {} ({}): scene {}, {}, BLAS core {}, loops {}", build.version, build.revision, scene,
                     counted(threads, "thread", "threads"), blas_core(), to_string(instruction_level()));
}

void require_free_output(const std::string& path, bool force, const std::vector<std::string>& read) {
  std::error_code error;
  for (const std::string& input : read) {
    if (std::filesystem::equivalent(path, input, error)) {
      throw InputError(
          fmt::format("{}: is the same file as {}, which is read; give another file to write", path, input));
    }
  }
  require_free(path, force, "give another name, or --force to replace it");
}

std::string joined_command_line(int argc, char** argv) {
  std::string line;
  for (int i = 0; i < argc; ++i) {
    const std::string word = argv[i];
    require(length_of_text(word) == word.size(), "argument {} is not UTF-8 text: {}; rename the file", i, word);
    line += (i > 0 ? " " : "") + quoted_word(word);
  }
  return line;
}

void print_value(const Json& value, const CommonFlags& flags, bool is_result) {
  if (flags.json || !flags.quiet || is_result) {
    put(flags.json ? json_text(value, 2) + '\n' : lines_text(value));
  }
}

}  // namespace touchfield
