#include <cmath>
#include <memory>
#include <optional>

#include <fmt/format.h>

#include "apps/commands/command_line.h"
#include "apps/commands/commands.h"
#include "apps/commands/compare_points.h"
#include "apps/commands/standard_streams.h"
#include "sim/core/require.h"
#include "sim/jobs/scene_changes.h"
#include "sim/run/run_compare.h"
#include "sim/run/run_file.h"

namespace touchfield {

namespace {

struct CompareCommand {
  std::string a;  // run.h5, or the directory that holds one
  std::string b;
  PointsComparison points;          // instead of b
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
  if (!command.points.points.empty()) {
    return compare_points(command.a, command.points, command.tolerance, flags);
  }
  require(!command.b.empty(), "compare: B is missing: give another run, or --points FILE");
  const std::string path_a = run_file_at(command.a);
  const std::string path_b = run_file_at(command.b);
  const Run a = read_run_file(path_a, say_warning);
  const Run b = read_run_file(path_b, say_warning);
  const RunDifference difference = compare_runs(a, b, scene_changes(a.scene, b.scene));
  const Deviation& largest = difference.largest_result;
  const bool within = !command.tolerance || largest.relative <= *command.tolerance;
  if (flags.json) {
    Json json = {{"a", {{"file", path_a}, {"name", a.name}, {"complete", a.complete}}},
                 {"b", {{"file", path_b}, {"name", b.name}, {"complete", b.complete}}},
                 {"tolerance", command.tolerance ? Json(*command.tolerance) : Json()},
                 {"within_tolerance", command.tolerance ? Json(within) : Json()}};
    json.update(difference_value(difference));
    put(json_text(json, 2) + "\n");
  } else {
    put(fmt::format("{}{}{}", heading('A', path_a, a), heading('B', path_b, b), describe_difference(difference)));
    if (command.tolerance) {
      put(tolerance_line(*command.tolerance, largest));
    }
  }
  return within ? 0 : 1;
}

}  // namespace

void add_compare_command(CLI::App& app, Invocation& invocation) {
  const auto compare = std::make_shared<CompareCommand>();
  CLI::App* command = app.add_subcommand("compare", "Compare two runs, or a run with a measured field");
  command->add_option("A", compare->a, "run.h5, or the directory that holds it")->required()->type_name(kH5File);
  CLI::Option* other = command->add_option("B", compare->b, "The other run")->type_name(kH5File);
  PointsComparison& points = compare->points;
  CLI::Option* file =
      command
          ->add_option(
              "--points", points.points,
              "Compare the field with measured points instead: a table with x_mm,y_mm,z_mm and p_pa, or p_re,p_im")
          ->excludes(other)
          ->type_name(kAnyFile);
  command->add_option("--method", points.method, "Method of the field; default: the run's first")->needs(file);
  command->add_option("--out", points.rows, "Write a CSV file with one row per point")
      ->needs(file)
      ->type_name(kAnyFile);
  command->add_option("--picture", points.picture, "Draw measured against computed values: a .png, .pdf or .svg file")
      ->needs(file)
      ->type_name(kAnyFile);
  command->add_flag("--force", points.force, "Replace these files")->needs(file);
  add_number(command, "--tolerance", compare->tolerance, schema::at_least(0),
             "Exit code 1 if a result, or the field at measured points, differs by more than this relative amount");
  finish_command(command, invocation,
                 [compare](const Invocation& invoked) { return compare_command(*compare, invoked.flags); });
}

}  // namespace touchfield
