#include <algorithm>
#include <cstdio>
#include <exception>
#include <map>
#include <new>
#include <optional>
#include <string>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "apps/commands/commands.h"
#include "apps/commands/compare_command.h"
#include "apps/commands/device_cli.h"
#include "apps/commands/interrupt_guard.h"
#include "apps/commands/standard_streams.h"
#include "sim/core/errors.h"
#include "sim/core/units.h"
#include "sim/core/version.h"
#include "solvers/linear/blas_core.h"
#include "solvers/linear/instruction_level.h"

namespace {

using touchfield::CommonFlags;

constexpr int kFailed = 1;
constexpr int kBadInput = 2;
constexpr int kNotBuilt = 3;
constexpr int kDevice = 4;

void add_common(CLI::App* command, CommonFlags& flags) {
  command->add_option("--threads", flags.threads, "Number of threads; default: all cores, or OMP_NUM_THREADS")
      ->check(CLI::Range(1, 4096));
  command->add_flag("--quiet", flags.quiet, "Show results, warnings and errors only");
  command->add_flag("--json", flags.json, "Print results as JSON");
}

void add_overrides(CLI::App* command, std::vector<std::string>& overrides) {
  command->add_option("--set", overrides, "Change a key of the scene: key.path=value, value in YAML; may be repeated")
      ->take_all()
      ->expected(1);
}

void add_scene(CLI::App* command, std::string& scene, std::vector<std::string>& overrides) {
  command->add_option("SCENE", scene, "Scene file (YAML)")->required();
  add_overrides(command, overrides);
}

std::string version_line() {
  const touchfield::BuildInfo build = touchfield::build_info();
  return fmt::format("touchfield {} ({})\n{}, {} build, flags {}", build.version, build.revision, build.compiler,
                     build.build_type, build.flags);
}

/// A choice of an enumerator by its name; help and errors list the names, not the numbers behind them.
template <typename Enum>
CLI::Validator named(const std::map<std::string, Enum>& values) {
  std::string names;
  for (const auto& [name, value] : values) {
    names += (names.empty() ? "" : ", ") + name;
  }
  return {[values, names](std::string& input) {
            const auto found = values.find(input);
            if (found == values.end()) {
              return fmt::format("{} is none of {}", input, names);
            }
            input = std::to_string(static_cast<int>(found->second));
            return std::string();
          },
          "{" + names + "}"};
}

std::map<std::string, touchfield::Scheme> named_schemes() {
  std::map<std::string, touchfield::Scheme> names;
  for (const touchfield::Scheme scheme : touchfield::all_schemes()) {
    names[touchfield::to_string(scheme)] = scheme;
  }
  return names;
}

/// What the command line asks for, run after it has been parsed as a whole.
int dispatch(int argc, char** argv) {
  CLI::App app(
      "Mid-air ultrasound haptics: transducer phases that press a wanted pattern on the skin of a hand.\n"
      "Exit codes: 0 ok, 1 failed, 2 bad input, 3 not built in, 4 device.",
      "touchfield");
  app.set_version_flag("--version", version_line());
  app.require_subcommand(1);
  CommonFlags flags;

  touchfield::RunCommand run;
  CLI::App* run_app = app.add_subcommand("run", "Compute a scene and write its results");
  auto* run_scene = run_app->add_option("SCENE", run.scene, "Scene file (YAML)");
  run_app->add_option("--from", run.from, "Repeat a run: its run.h5, or the directory that holds it")
      ->excludes(run_scene);
  add_overrides(run_app, run.overrides);
  run_app->add_option("-o,--output", run.output,
                      "Output directory; default: results/runs/NAME-NNNN, the next free number");
  run_app->add_flag("--force", run.force, "Replace the run that the output directory holds");
  add_common(run_app, flags);

  touchfield::CheckCommand check;
  CLI::App* check_app = app.add_subcommand("check", "Say what a scene would build and cost, without running it");
  add_scene(check_app, check.scene, check.overrides);
  check_app->add_flag("--resolved", check.resolved, "Print the scene with every default written out");
  check_app->add_flag("--accuracy", check.accuracy,
                      "Measure the discretisation error on this very mesh (solves it some times)");
  add_common(check_app, flags);

  touchfield::StudyCommand study;
  std::vector<double> edges_mm;
  CLI::App* study_app = app.add_subcommand("study", "Solve a scene in every way there is: speed against error");
  add_scene(study_app, study.scene, study.overrides);
  study_app->add_option("-o,--output", study.output,
                        "Output directory; default: results/runs/NAME_study-NNNN, the next free number");
  study_app->add_flag("--force", study.force, "Replace what the output directory holds");
  auto* budget = study_app->add_option("--budget", study.budget, "Pick the most accurate way within so many seconds")
                     ->check(CLI::PositiveNumber);
  study_app->add_option("--error", study.error, "Pick the cheapest way within so many percent")
      ->check(CLI::PositiveNumber)
      ->excludes(budget);
  study_app->add_option("--edges-mm", edges_mm, "Edge lengths [mm]; default: 1.4, 1 and 0.7 times the scene's")
      ->check(CLI::PositiveNumber)
      ->delimiter(',');
  study_app->add_option("--schemes", study.options.schemes, "Schemes; default: all")
      ->transform(named(named_schemes()))
      ->delimiter(',');
  study_app->add_option("--solvers", study.options.solvers, "Ways to solve; default: all")
      ->transform(named<touchfield::SolverKind>({{"lu", touchfield::SolverKind::kLu},
                                                 {"gmres", touchfield::SolverKind::kGmres},
                                                 {"matrix_free", touchfield::SolverKind::kMatrixFree}}))
      ->delimiter(',');
  study_app->add_option("--precisions", study.options.precisions, "Precisions of the matrix; default: both")
      ->transform(named<touchfield::Precision>(
          {{"double", touchfield::Precision::kDouble}, {"single", touchfield::Precision::kSingle}}))
      ->delimiter(',');
  study_app->add_option("--rung-seconds", study.options.rung_seconds, "Skip ways expected to take longer")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  add_common(study_app, flags);

  touchfield::SweepCommand sweep;
  CLI::App* sweep_app = app.add_subcommand("sweep", "Compute many scenes: a base with changes");
  auto* sweep_file = sweep_app->add_option("SWEEP", sweep.sweep, "Sweep file (YAML)");
  sweep_app->add_option("-o,--output", sweep.output,
                        "Output directory; default: results/runs/NAME_sweep-NNNN, the next free number");
  add_overrides(sweep_app, sweep.overrides);
  sweep_app->add_option("--jobs", sweep.jobs, "Cases at a time; default: one for each body, at most one a thread")
      ->check(CLI::Range(1, 4096));
  sweep_app
      ->add_option(
          "--case-seconds", sweep.case_seconds,
          "Give up a case that takes longer; default: 600 and 20 times what it is expected to, or 10 times the "
          "longest so far")
      ->check(CLI::PositiveNumber);
  sweep_app->add_option("--shard", sweep.shard, "Compute part i of n only: i/n")->capture_default_str();
  sweep_app->add_flag("--resume", sweep.resume,
                      "Go on with the sweep in the output directory; begin it if there is none");
  sweep_app->add_flag("--retry-failed", sweep.retry_failed, "Go on, and compute failed cases anew");
  sweep_app->add_option("--plot", sweep.metric, "Metric of the plot")->capture_default_str();
  sweep_app->add_option("--collect", sweep.collect, "Write the tables of a directory, its shards merged, instead")
      ->excludes(sweep_file);
  add_common(sweep_app, flags);
  CLI::App* worker_app = app.add_subcommand("sweep-worker")->group("");  // started by sweep

  std::string run_file;
  CLI::App* info_app = app.add_subcommand("info", "Describe a run.h5");
  info_app->add_option("RUN", run_file, "run.h5, or the directory that holds it")->required();
  add_common(info_app, flags);

  touchfield::CompareCommand compare;
  CLI::App* compare_app = app.add_subcommand("compare", "Say how two runs differ");
  compare_app->add_option("A", compare.a, "run.h5, or the directory that holds it")->required();
  compare_app->add_option("B", compare.b, "The other one")->required();
  compare_app
      ->add_option("--tolerance", compare.tolerance, "Exit code 1 if a result differs by more than this, relatively")
      ->check(CLI::NonNegativeNumber);
  add_common(compare_app, flags);

  touchfield::HandCommand hand;
  double breadth_mm = 88.3;
  double length_mm = 193.3;
  double edge_mm = 3.0;
  const std::map<std::string, double> units = {{"mm", 1e-3}, {"cm", 1e-2}, {"m", 1.0}};
  const std::map<std::string, touchfield::HandSide> sides = {{"right", touchfield::HandSide::kRight},
                                                             {"left", touchfield::HandSide::kLeft}};
  CLI::App* hand_app = app.add_subcommand("hand", "Write the built-in hand as a mesh file (STL, OBJ or PLY)");
  hand_app->add_option("-o,--output", hand.output, "Mesh file; its ending names the format")->required();
  hand_app->add_flag("--force", hand.force, "Replace the mesh file if it exists");
  hand_app->add_option("--pose", hand.options.pose, "Pose")
      ->check(CLI::IsMember(touchfield::hand_poses()))
      ->capture_default_str();
  hand_app->add_option("--breadth-mm", breadth_mm, "Hand breadth [mm]")->capture_default_str();
  hand_app->add_option("--length-mm", length_mm, "Hand length [mm]")->capture_default_str();
  hand_app->add_option("--side", hand.options.side, "right or left")->transform(named(sides));
  hand_app->add_option("--edge-mm", edge_mm, "Edge length [mm]")->capture_default_str();
  hand_app->add_option("--unit", hand.unit, "Unit of the file: mm (default), cm or m")
      ->transform(CLI::CheckedTransformer(units));
  add_common(hand_app, flags);

  touchfield::MeshCommand mesh;
  std::string cut_plane;
  double remesh_mm = 0;
  double weld_mm = 0;
  double hole_mm = 0;
  double stray_percent = 100.0 * mesh.repair_options.stray;
  CLI::App* mesh_app =
      app.add_subcommand("mesh", "Inspect, repair, cut or remesh a mesh file (STL, OBJ, PLY, OFF, VTP)");
  mesh_app->add_option("FILE", mesh.file, "Mesh file; its ending names the format")->required();
  mesh_app->add_option("-o,--output", mesh.output, "Mesh file to write; default: report only");
  mesh_app->add_flag("--force", mesh.force, "Replace the mesh file to write if it exists");
  mesh_app->add_option("--unit", mesh.unit, "Unit of FILE: mm, cm or m; default: guessed from its size")
      ->check(CLI::IsMember({"mm", "cm", "m"}));
  mesh_app->add_option("--output-unit", mesh.output_unit, "Unit of the file written: mm, cm or m; default: FILE's")
      ->check(CLI::IsMember({"mm", "cm", "m"}));
  auto* repair = mesh_app->add_flag("--repair", mesh.repair,
                                    "Weld, drop stray pieces, orient, fill small holes; an error says what is left");
  auto* weld = mesh_app
                   ->add_option("--weld-mm", weld_mm,
                                "Points this near become one; default: 1e-5 of the body's diagonal, at most a "
                                "hundredth of the median edge")
                   ->check(CLI::NonNegativeNumber)
                   ->needs(repair);
  auto* hole =
      mesh_app
          ->add_option("--hole-mm", hole_mm, "Longest way round a hole to fill; default: 0.1 of the body's diagonal")
          ->check(CLI::NonNegativeNumber)
          ->needs(repair);
  mesh_app->add_option("--stray-percent", stray_percent, "Drop pieces below this share of the largest one's area")
      ->check(CLI::Range(0.0, 100.0))
      ->needs(repair)
      ->capture_default_str();
  auto* cut =
      mesh_app->add_option("--cut", cut_plane,
                           "Cut by a plane and cap: x,y,z,nx,ny,nz (a point and a normal, which points to what is cut "
                           "off), or y=-20, y<=-20 (keeps that side), y>=-20; in FILE's unit");
  auto* remesh = mesh_app->add_option("--remesh", remesh_mm, "Mesh anew with edges of this length [mm]")
                     ->check(CLI::PositiveNumber);
  add_common(mesh_app, flags);

  touchfield::DeviceCommands devices;
  touchfield::add_device_commands(app, devices, [&](CLI::App* command) { add_common(command, flags); });

  CLI::App* doctor_app = app.add_subcommand("doctor", "Say what would make runs slow or incomplete on this machine");
  add_common(doctor_app, flags);

  std::string schema_format = "markdown";
  CLI::App* schema_app = app.add_subcommand("schema", "Print the schema of scene files");
  schema_app->add_option("--format", schema_format, "markdown, json (for editors) or template (a scene with every key)")
      ->check(CLI::IsMember({"markdown", "json", "template"}))
      ->capture_default_str();

  const auto known = app.get_subcommands([](const CLI::App*) { return true; });
  const auto is_named = [&](const CLI::App* command) { return command->get_name() == argv[1]; };
  if (argc > 1 && argv[1][0] != '-' && std::none_of(known.begin(), known.end(), is_named)) {
    throw touchfield::InputError(
        fmt::format("unknown command '{}'; there are run, check, study, sweep, compare, info, hand, mesh, send, array, "
                    "doctor and schema",
                    argv[1]));
  }
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : kBadInput;
  }
  if (run_app->parsed()) {
    if (run.scene.empty() && run.from.empty()) {
      throw touchfield::InputError("run: SCENE is missing: a scene file, or --from RUN.h5");
    }
    run.command_line = touchfield::joined_command_line(argc, argv);
    return touchfield::run_command(run, flags);
  }
  if (check_app->parsed()) {
    return touchfield::check_command(check, flags);
  }
  if (study_app->parsed()) {
    for (const double edge : edges_mm) {
      study.options.edges.push_back(edge * touchfield::kMillimetre);
    }
    return touchfield::study_command(study, flags);
  }
  if (sweep_app->parsed()) {
    if (sweep.sweep.empty() && sweep.collect.empty()) {
      throw touchfield::InputError("sweep: SWEEP is missing: a sweep file, or --collect DIR");
    }
    sweep.command_line = touchfield::joined_command_line(argc, argv);
    return touchfield::sweep_command(sweep, flags);
  }
  if (worker_app->parsed()) {
    return touchfield::sweep_worker_command();
  }
  if (doctor_app->parsed()) {
    return touchfield::doctor_command(flags);
  }
  if (info_app->parsed()) {
    return touchfield::info_command(run_file, flags);
  }
  if (const auto code = touchfield::run_device_commands(devices, flags)) {
    return *code;
  }
  if (compare_app->parsed()) {
    return touchfield::compare_command(compare, flags);
  }
  if (hand_app->parsed()) {
    hand.options.breadth = breadth_mm * touchfield::kMillimetre;
    hand.options.length = length_mm * touchfield::kMillimetre;
    hand.options.edge = edge_mm * touchfield::kMillimetre;
    return touchfield::hand_command(hand, flags);
  }
  if (mesh_app->parsed()) {
    const auto in_metres = [](const CLI::Option* option, double mm) {
      return *option ? std::optional(mm * touchfield::kMillimetre) : std::nullopt;
    };
    mesh.repair_options = {in_metres(weld, weld_mm), in_metres(hole, hole_mm), stray_percent / 100.0};
    mesh.cut = *cut ? std::optional(cut_plane) : std::nullopt;
    mesh.edge = in_metres(remesh, remesh_mm);
    return touchfield::mesh_command(mesh, flags);
  }
  return touchfield::schema_command(schema_format);
}

/// A level that TOUCHFIELD_LEVEL misnames is found before anything is computed.
void check_instruction_level() {
  try {
    touchfield::instruction_level();
  } catch (const std::invalid_argument& error) {
    throw touchfield::InputError(error.what());
  }
}

int report(const std::string& message, int code) {
  touchfield::say(fmt::format("touchfield: error: {}\n", message));
  return code;
}

int exit_code_of(int argc, char** argv) {
  try {
    check_instruction_level();
    return dispatch(argc, argv);
  } catch (const touchfield::InputError& error) {
    return report(error.what(), kBadInput);
  } catch (const touchfield::NotBuiltError& error) {
    return report(error.what(), kNotBuilt);
  } catch (const touchfield::DeviceError& error) {
    return report(error.what(), kDevice);
  } catch (const std::bad_alloc&) {
    return report("out of memory; choose a larger body.edge_mm", kFailed);
  } catch (const std::exception& error) {
    return report(error.what(), kFailed);
  }
}

}  // namespace

int main(int argc, char** argv) {
  touchfield::restart_with_better_blas_core(argv);
  touchfield::hold_standard_streams();
  return touchfield::finish_output(exit_code_of(argc, argv));
}
