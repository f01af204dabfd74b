#include <algorithm>
#include <filesystem>
#include <memory>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "apps/commands/command_line.h"
#include "apps/commands/commands.h"
#include "apps/commands/console_progress.h"
#include "apps/commands/job_console.h"
#include "apps/commands/standard_streams.h"
#include "sim/core/files.h"
#include "sim/core/json.h"
#include "sim/core/require.h"
#include "sim/core/units.h"
#include "sim/jobs/check_scene.h"
#include "sim/jobs/sweep_case.h"
#include "sim/motion/play.h"
#include "sim/pictures/plots.h"
#include "sim/run/check.h"
#include "sim/run/run_directory.h"
#include "sim/run/study.h"
#include "sim/run/text_table.h"
#include "sim/scene/input.h"
#include "sim/scene/scene_reader.h"
#include "sim/scene/schema_info.h"
#include "sim/scene/sweep_reader.h"

namespace touchfield {

namespace {

constexpr const char* kScene =
    R"(# A hand and its arm above four AUTD3 units. A disc on the pad of the index finger is to feel a pressure.
name: {}

# Transducers in the plane z = 0, emitting along +z. Others: grid, sonicsurface, positions (a file).
array:
  autd3: {{layout: [2, 2]}}
  level: 0.32                      # of full drive

# The body whose skin scatters the sound. Others: mesh (a file), capsule, sphere, box.
body:
  hand: {{pose: index_up, forearm_mm: 250}}
  place: {{landmark: index_pad, at_mm: [0, -60, 150]}}
  edge_mm: {{near_target: 1.8, far: 6, within_mm: 12}}  # shorter edges: less error, more time
  keep_within_mm: 30               # of the target: scattering is solved there; leave it out for the whole body

# The target: the skin in a disc, and the pressure that is wanted there.
target:
  points: [{{at: index_pad, diameter_mm: 10}}]
  pressure_pa: 4000                # or best

# The methods that search the phases.
solve:
  methods: [surface, focus]

# The mesh on which all methods are compared: the whole hand and the arm.
evaluation: {{edge_mm: {{near_target: 1.4, far: 5, within_mm: 8}}}}
)";

struct InitCommand {
  std::string name;
  bool force = false;
};

int init_command(const InitCommand& command, const CommonFlags& flags) {
  std::filesystem::path path(command.name);
  path += path.extension() == ".yaml" ? "" : ".yaml";
  const std::string name = path.stem().string();
  require(schema::is_name(name), "init: the name {} must be letters, digits, _ and -",
          schema::quoted_for_message(name));
  require_free_output(path.string(), command.force);
  write_atomically(path.string(), {fmt::format(kScene, name)});
  if (flags.json) {
    put(json_text(nlohmann::ordered_json{{"file", path.string()}}, 2) + '\n');
  } else if (!flags.quiet) {
    put(fmt::format("{}: next, touchfield run {}\n", path.string(), path.string()));
  }
  return 0;
}

struct CheckCommand {
  std::string scene;
  std::vector<std::string> overrides;
  bool resolved = false;
  bool accuracy = false;  // measure the discretisation error on this mesh
};

/// A sweep: how many cases and bodies, and what the first case of each body takes.
int check_sweep(const CheckCommand& command, const CommonFlags& flags) {
  const SweepInput input = read_sweep_input(command.scene, command.overrides);
  constexpr std::size_t kMostShown = 20;
  const Json shown = list_cases(input, kMostShown);
  double largest = 0;
  for (const Json& one : shown) {
    const auto reason = one.at("reason").get<std::string>();
    require(reason.empty(), "{}: case {}: {}", input.plan.name, one.at("case").get<int>(), reason);
    largest = std::max(largest, one.at("memory_mib").get<double>());
  }
  print_value({{"name", input.plan.name},
               {"cases", input.scenes.size()},
               {"bodies", 1 + std::ranges::max(body_groups(input.scenes))},
               {"memory_mib", largest},
               {"available_mib", available_memory() / (1024.0 * 1024.0)},
               {"first_cases", shown}},
              flags);
  return 0;
}

int check_command(const CheckCommand& command, const CommonFlags& flags) {
  apply_threads(flags);
  if (is_sweep_file(command.scene)) {
    return check_sweep(command, flags);
  }
  Scene scene = read_scene(command.scene, command.overrides);
  if (command.resolved) {
    put(resolved_yaml(scene));
    return 0;
  }
  ConsoleProgress progress(flags);
  const SceneCheck checked = check_scene(std::move(scene), command.accuracy, progress);
  print_value(check_value(checked), flags);
  require_memory(checked.report);
  if (checked.motion) {
    require_motion_memory(checked.model.fixed->scene);
  }
  if (checked.pattern) {
    require_memory(*checked.pattern);
  }
  return 0;
}

struct StudyCommand {
  std::string scene;
  std::vector<std::string> overrides;
  JobOutput output;
  StudyOptions options;
};

/// The rungs as the program prints them.
Json lines_of(const Study& study) {
  Json lines = Json::array();
  std::ranges::transform(study.rungs, std::back_inserter(lines), rung_value);
  return lines;
}

void draw(const std::string& path, const std::string& name, const Study& study) {
  std::vector<LineValue> values;
  for (const StudyRung& rung : study.rungs) {
    values.push_back({rung.scheme, rung.edge_mm, 100.0 * rung.error_reference});
  }
  draw_plot(path, {.texts = {.title = name + ": error against mesh and scheme"},
                   .x = "edge length [mm]",
                   .panels = {{"error of the pressure [%]", lines_through(values)}}});
}

int study_command(const StudyCommand& command, const Invocation& invoked) {
  JobConsole console(invoked, "study.csv holds the ways that are finished; {} says that others are missing");
  const Scene scene = read_scene(command.scene, command.overrides);
  require_apart(command.output.directory, command.scene, scene);
  std::vector<Model> models = study_models(scene, command.options);
  const std::string picture = "study.png";
  return console.finish(
      command.output,
      Job<Study>{.name = scene.name + "_study",
                 .files = {"study.log", "failed.json", "study.csv", picture},
                 .compute =
                     [&](RunDirectory& directory, Progress& progress) {
                       const auto keep = [&](const Study& so_far) {
                         write_text_file(directory.file("study.csv"), csv_text(rung_value({}), lines_of(so_far)));
                       };
                       Study study = run_study(scene, std::move(models), command.options, progress, keep);
                       draw(directory.file(picture), scene.name, study);
                       return study;
                     },
                 .value =
                     [&](const Study& study, const std::string& directory) {
                       return Json{{"name", scene.name}, {"directory", directory}, {"rungs", lines_of(study)}};
                     },
                 .print =
                     [](const Study& study, const Json& value, bool) {
                       const Json& rungs = value["rungs"];
                       return fmt::format("reference: {}\n{}  pareto: no other is both faster and more accurate\n",
                                          study.reference, table_text(rungs, rungs.size()));
                     }});
}

}  // namespace

void add_init_command(CLI::App& app, Invocation& invocation) {
  const auto init = std::make_shared<InitCommand>();
  CLI::App* command = app.add_subcommand("init", "Write a short scene with comments to start from");
  command->add_option("NAME", init->name, "Name of the scene; the file is NAME.yaml")->required();
  command->add_flag("--force", init->force, "Replace the file if it exists");
  finish_command(command, invocation, [init](const Invocation& invoked) { return init_command(*init, invoked.flags); });
}

void add_check_command(CLI::App& app, Invocation& invocation) {
  const auto check = std::make_shared<CheckCommand>();
  CLI::App* command = app.add_subcommand("check", "Describe what a scene builds and costs, without solving it");
  add_scene(command, check->scene, check->overrides);
  command->add_flag("--resolved", check->resolved, "Print the scene with every default written out");
  command->add_flag("--accuracy", check->accuracy,
                    "Measure the discretisation error on this mesh (takes several solutions)");
  finish_command(command, invocation,
                 [check](const Invocation& invoked) { return check_command(*check, invoked.flags); });
}

void add_study_command(CLI::App& app, Invocation& invocation) {
  const auto study = std::make_shared<StudyCommand>();
  CLI::App* command = app.add_subcommand("study", "Compare the speed and the error of all ways to solve a scene");
  add_scene(command, study->scene, study->overrides);
  add_compute_device(command, study->overrides);
  add_output(command, study->output, "Output directory; default: results/runs/NAME_study-NNNN, the next free number",
             "Replace what the output directory holds");
  add_numbers(command, "--edges-mm", study->options.edges, schema::above(0),
              "Edge lengths [mm]; default: 1.4, 1 and 0.7 times the scene's", kMillimetre)
      ->delimiter(',');
  std::map<std::string, Scheme> schemes;
  for (const Scheme scheme : all_schemes()) {
    schemes[to_string(scheme)] = scheme;
  }
  command->add_option("--schemes", study->options.schemes, "Schemes; default: all")
      ->transform(named(schemes))
      ->delimiter(',');
  command->add_option("--solvers", study->options.solvers, "Ways to solve; default: all")
      ->transform(named<SolverKind>({{"lu", SolverKind::kLu},
                                     {"gmres", SolverKind::kGmres},
                                     {"matrix_free", SolverKind::kMatrixFree},
                                     {"fft", SolverKind::kFft}}))
      ->delimiter(',');
  command->add_option("--precisions", study->options.precisions, "Precisions of the matrix; default: both")
      ->transform(named<Precision>({{"double", Precision::kDouble}, {"single", Precision::kSingle}}))
      ->delimiter(',');
  add_number(command, "--rung-seconds", study->options.rung_seconds, schema::above(0),
             "Skip ways that are expected to take longer [s]");
  finish_command(command, invocation, [study](const Invocation& invoked) { return study_command(*study, invoked); });
}

}  // namespace touchfield
