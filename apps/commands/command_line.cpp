#include "apps/commands/command_line.h"

#include <filesystem>
#include <utility>

#include <fmt/format.h>
#include <omp.h>

#include "sim/core/errors.h"
#include "sim/core/units.h"
#include "sim/core/version.h"
#include "solvers/linear/blas_core.h"
#include "solvers/linear/instruction_level.h"
#include "solvers/linear/system_limits.h"

namespace touchfield {

void finish_command(CLI::App* command, Invocation& invocation, std::function<int(const Invocation&)> action) {
  CommonFlags& flags = invocation.flags;
  command->add_option("--threads", flags.threads, "Number of threads; default: all cores, or OMP_NUM_THREADS")
      ->check(CLI::Range(1, kMostThreads));
  command->add_flag("--quiet", flags.quiet, "Show results, warnings and errors only");
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
      ->expected(1);
}

void add_compute_device(CLI::App* command, std::vector<std::string>& overrides) {
  command
      ->add_option_function<std::string>(
          "--device", [&overrides](const std::string& device) { overrides.push_back("solve.device=" + device); },
          "What computes, in place of the scene's solve.device")
      ->type_name("auto|cpu|cuda|cuda:N");
}

void add_scene(CLI::App* command, std::string& scene, std::vector<std::string>& overrides) {
  command->add_option("SCENE", scene, "Scene file (YAML)")->required()->type_name(kYamlFile);
  add_overrides(command, overrides);
}

CLI::Option* add_millimetres(CLI::App* command, const std::string& name, double& length, const std::string& what) {
  return command
      ->add_option_function<double>(
          name, [&length](const double& mm) { length = mm * kMillimetre; }, what)
      ->default_str(fmt::format("{:g}", length / kMillimetre));
}

CLI::Option* add_millimetres(CLI::App* command, const std::string& name, std::optional<double>& length,
                             const std::string& what) {
  return command->add_option_function<double>(
      name, [&length](const double& mm) { length = mm * kMillimetre; }, what);
}

int apply_threads(const CommonFlags& flags) {
  if (flags.threads > 0) {
    omp_set_num_threads(flags.threads);  // the OpenMP flavour of OpenBLAS follows
  }
  take_blas_buffers(omp_get_max_threads());
  return omp_get_max_threads();
}

std::string first_log_line(const std::string& scene, int threads) {
  const BuildInfo build = build_info();
  return fmt::format("touchfield {} ({}): scene {}, {} threads, BLAS core {}, loops {}", build.version, build.revision,
                     scene, threads, blas_core(), to_string(instruction_level()));
}

void require_free_output(const std::string& path, bool force) {
  std::error_code error;
  if (!force && std::filesystem::exists(std::filesystem::symlink_status(path, error))) {
    throw InputError(
        fmt::format("{}: there is a file of that name; give another with -o, or --force to replace it", path));
  }
}

std::string joined_command_line(int argc, char** argv) {
  std::string line;
  for (int i = 0; i < argc; ++i) {
    const std::string word = argv[i];
    const bool plain = !word.empty() && word.find_first_of(" \t\n'\"\\$*?[]{}()<>|&;#~`!") == std::string::npos;
    std::string quoted = word;
    if (!plain) {
      quoted = "'";
      for (const char c : word) {
        quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
      }
      quoted += "'";
    }
    line += (i > 0 ? " " : "") + quoted;
  }
  return line;
}

}  // namespace touchfield
