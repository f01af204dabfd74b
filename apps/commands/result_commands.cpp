#include <array>
#include <cmath>
#include <fcntl.h>
#include <filesystem>
#include <memory>
#include <optional>
#include <spawn.h>
#include <string>
#include <unistd.h>

#include <fmt/format.h>

#include "apps/commands/command_line.h"
#include "apps/commands/commands.h"
#include "apps/commands/console_progress.h"
#include "apps/commands/standard_streams.h"
#include "sim/core/errors.h"
#include "sim/core/files.h"
#include "sim/core/require.h"
#include "sim/jobs/scene_changes.h"
#include "sim/model/model.h"
#include "sim/pictures/figures.h"
#include "sim/pictures/plots.h"
#include "sim/run/archive_file.h"
#include "sim/run/motion_file.h"
#include "sim/run/motion_summary.h"
#include "sim/run/run_compare.h"
#include "sim/run/run_directory.h"
#include "sim/run/run_file.h"
#include "sim/run/run_text.h"
#include "sim/run/scan_comparison.h"
#include "sim/run/text_table.h"
#include "sim/scene/scene_reader.h"
#include "sim/view/view_motion.h"
#include "sim/view/view_page.h"

namespace touchfield {

namespace {

/// What `compare RUN --points FILE` is asked for.
struct PointsComparison {
  std::string points;   // measured points
  std::string method;   // empty: the run's first
  std::string rows;     // CSV file with a row a point; empty: none
  std::string picture;  // PNG file; empty: none
  bool force = false;   // whether these files replace others
};

void draw(const PointsComparison& asked, const Run& run, const std::string& method, const ScanComparison& comparison) {
  PlotLine points{.label = "points", .points = {}, .is_joined = false};
  double most = 0;
  for (const ScanPoint& point : comparison.points) {
    if (point.left_out.empty()) {
      const double measured = std::abs(point.measured);
      points.points.push_back({std::abs(point.computed), measured, measured, measured});
      most = std::max({most, points.points.back().x, measured});
    }
  }
  const PlotLine same{.label = "equal", .points = {{0, 0, 0, 0}, {most, most, most, most}}, .is_marked = false};
  draw_plot(asked.picture, {.texts = {.title = fmt::format("{}: {}", run.name, method),
                                      .subtitle = "measured against computed pressure",
                                      .caption = fmt::format("{} of {} points, scale {:.4g}", comparison.used,
                                                             comparison.points.size(), comparison.fit.scale),
                                      .foot = fmt::format("Difference {:.3g} % (L2), correlation {:.4f}",
                                                          100 * comparison.fit.relative, comparison.fit.correlation)},
                            .x = "computed, scaled",
                            .panels = {{"measured, as in the file", {points, same}}}});
}

/// Compares a run's field with measured points and prints what comes of it.
///
/// tolerance   of the relative L2 difference
/// returns     the exit code: 1 if the difference is above the tolerance
int compare_points(const std::string& run_path, const PointsComparison& asked, const std::optional<double>& tolerance,
                   const CommonFlags& flags) {
  apply_threads(flags);
  const std::string path = run_file_at(run_path);
  require(asked.rows.empty() || asked.rows != asked.picture, "--out and --picture are both {}: give different files",
          asked.rows);
  for (const std::string& output : {asked.rows, asked.picture}) {
    if (!output.empty()) {
      require_free_output(output, asked.force, {path, asked.points});
    }
  }
  if (!asked.picture.empty()) {
    require(asked.picture.ends_with(".png"), "{}: the name of a picture must end in .png", asked.picture);
  }
  const Run run = read_run_file(path, say_warning);
  require(!run.methods.empty(), "{}: no method has finished", path);
  const std::string method = asked.method.empty() ? run.methods.front().name : asked.method;
  const MeasuredPoints measured = read_measured_points(asked.points);
  const Scene scene = read_scene_text(run.scene, path, "");
  const Wave wave(build_medium(scene.medium, scene.frequency), scene.frequency);
  const ScanComparison comparison = compare_scan(run, wave, method, measured);
  const bool complex = !std::isnan(comparison.fit.turn);
  if (!asked.rows.empty()) {
    write_scan_csv(asked.rows, comparison, complex);
  }
  if (!asked.picture.empty()) {
    draw(asked, run, method, comparison);
  }
  const bool within = !tolerance || comparison.fit.relative <= *tolerance;
  Json value = {{"run", {{"file", path}, {"name", run.name}, {"complete", run.complete}}},
                {"measured", asked.points},
                {"method", method},
                {"tolerance", tolerance ? Json(*tolerance) : Json()},
                {"within_tolerance", tolerance ? Json(within) : Json()}};
  value.update(scan_value(comparison, complex));
  value[flags.json ? "points" : "left_out"] = scan_points(comparison, complex, !flags.json);
  print_value(value, flags, true);
  return within ? 0 : 1;
}

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

struct ViewCommand {
  std::string run;
  std::string output;  // empty: a temporary file, which a browser opens
  bool force = false;  // whether it replaces another
};

/// Lets the desktop open a file.
/// returns   whether it tries to
bool open_by_desktop(std::string path) {
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    posix_spawn_file_actions_addopen(&actions, stream, "/dev/null", O_RDWR, 0);
  }
  std::string opener = "xdg-open";
  const std::array<char*, 3> arguments = {opener.data(), path.data(), nullptr};
  pid_t started = 0;
  const int error = ::posix_spawnp(&started, opener.c_str(), &actions, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  return error == 0;
}

std::string page_of(const std::string& file) {
  if (archive_format(file) != kMotionArchive.name()) {
    return run_page(read_run_file(file, say_warning));
  }
  const Motion motion = read_motion_file(file, say_warning);
  return motion_page(motion, motion_strip(motion));
}

int view_command(const ViewCommand& command) {
  const std::string file = result_file_at(command.run);
  std::string page = command.output;
  if (page.empty()) {
    const std::filesystem::path whole = std::filesystem::absolute(file);
    page = (std::filesystem::temp_directory_path() / fmt::format("touchfield-{}-{}-{}.html", ::getuid(),
                                                                 whole.parent_path().filename().string(),
                                                                 checksum(whole.string())))
               .string();
  } else {
    require_free_output(page, command.force, {file});
  }
  write_text_file(page, page_of(file));
  put(fmt::format("page in {}\n", page));
  if (command.output.empty() && !open_by_desktop(page)) {
    put("Open it in a browser: xdg-open is not there.\n");
  }
  return 0;
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
  command->add_option("--picture", points.picture, "Draw measured against computed values: a .png file")
      ->needs(file)
      ->type_name(kAnyFile);
  command->add_flag("--force", points.force, "Replace these files")->needs(file);
  add_number(command, "--tolerance", compare->tolerance, schema::at_least(0),
             "Exit code 1 if a result, or the field at measured points, differs by more than this relative amount");
  finish_command(command, invocation,
                 [compare](const Invocation& invoked) { return compare_command(*compare, invoked.flags); });
}

void add_info_command(CLI::App& app, Invocation& invocation) {
  const auto path = std::make_shared<std::string>();
  CLI::App* command = app.add_subcommand("info", "Describe a run.h5, a motion.h5 or a pattern.h5");
  command->add_option("RUN", *path, "run.h5, motion.h5 or pattern.h5, or the directory that holds it")
      ->required()
      ->type_name(kH5File);
  finish_command(command, invocation, [path](const Invocation& invoked) { return info_command(*path, invoked.flags); });
}

void add_view_command(CLI::App& app, Invocation& invocation) {
  const auto view = std::make_shared<ViewCommand>();
  CLI::App* command = app.add_subcommand("view", "Open a result in a browser: the skin in 3D, methods side by side");
  command->add_option("RUN", view->run, "run.h5, motion.h5 or pattern.h5, or the directory that holds it")
      ->required()
      ->type_name(kH5File);
  command->add_option("-o,--output", view->output, "Write the page, one HTML file, instead of opening it")
      ->type_name(kAnyFile);
  command->add_flag("--force", view->force, "Replace this file");
  finish_command(command, invocation, [view](const Invocation&) { return view_command(*view); });
}

}  // namespace touchfield
