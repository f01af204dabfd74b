#include <cmath>
#include <memory>

#include <fmt/format.h>

#include "apps/commands/command_line.h"
#include "apps/commands/commands.h"
#include "apps/commands/compare_json.h"
#include "apps/commands/standard_streams.h"
#include "sim/batch/scene_changes.h"
#include "sim/store/run_compare.h"
#include "sim/store/run_file.h"

namespace touchfield {

namespace {

struct CompareCommand {
  std::string a;  // run.h5, or the directory that holds one
  std::string b;
  std::optional<double> tolerance;  // relative
};

std::string heading(char letter, const std::string& path, const Run& run) {
  return fmt::format("{:<9} {}: {}, {}\n", letter, path, run.name, run.complete ? "complete" : "NOT COMPLETE");
}

std::string tolerance_line(double tolerance, const Deviation& largest) {
  if (largest.relative <= tolerance) {
    return fmt::format("{:<9} {:g}: every result is within it\n", "tolerance", tolerance);
  }
  const std::string far = std::isfinite(largest.relative) ? fmt::format(" differs by {:.2g}", largest.relative) : "";
  return fmt::format("{:<9} {:g}: EXCEEDED: {}{}\n", "tolerance", tolerance, largest.what, far);
}

int compare_command(const CompareCommand& command, const CommonFlags& flags) {
  const std::string path_a = run_file_at(command.a);
  const std::string path_b = run_file_at(command.b);
  const Run a = read_run_file(path_a);
  const Run b = read_run_file(path_b);
  const RunDifference difference = compare_runs(a, b, scene_changes(a.scene, b.scene));
  const bool within = !command.tolerance || difference.largest_result.relative <= *command.tolerance;
  if (flags.json) {
    nlohmann::ordered_json json = {{"a", {{"file", path_a}, {"name", a.name}, {"complete", a.complete}}},
                                   {"b", {{"file", path_b}, {"name", b.name}, {"complete", b.complete}}}};
    json["tolerance"] = command.tolerance ? nlohmann::ordered_json(*command.tolerance) : nullptr;
    json["within_tolerance"] = command.tolerance ? nlohmann::ordered_json(within) : nullptr;
    json.update(difference_json(difference));
    put(fmt::format("{}\n", json.dump(2)));
  } else {
    put(fmt::format("{}{}{}", heading('A', path_a, a), heading('B', path_b, b), describe_difference(difference)));
    if (command.tolerance) {
      put(tolerance_line(*command.tolerance, difference.largest_result));
    }
  }
  return within ? 0 : 1;
}

}  // namespace

void add_compare_command(CLI::App& app, Invocation& invocation) {
  const auto compare = std::make_shared<CompareCommand>();
  CLI::App* command = app.add_subcommand("compare", "Say how two runs differ");
  command->add_option("A", compare->a, "run.h5, or the directory that holds it")->required();
  command->add_option("B", compare->b, "The other one")->required();
  command
      ->add_option("--tolerance", compare->tolerance, "Exit code 1 if a result differs by more than this, relatively")
      ->check(CLI::NonNegativeNumber);
  finish_command(command, invocation,
                 [compare](const Invocation& invoked) { return compare_command(*compare, invoked.flags); });
}

}  // namespace touchfield
