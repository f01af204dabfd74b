#include <memory>

#include <fmt/format.h>

#include "apps/commands/claimed_directory.h"
#include "apps/commands/command_line.h"
#include "apps/commands/commands.h"
#include "apps/commands/console_progress.h"
#include "apps/commands/standard_streams.h"
#include "sim/assess/study.h"
#include "sim/batch/run_directory.h"
#include "sim/batch/run_model.h"
#include "sim/core/errors.h"
#include "sim/core/units.h"
#include "sim/pictures/study_picture.h"
#include "sim/scene/scene_reader.h"
#include "sim/store/run_file.h"
#include "sim/store/study_files.h"

namespace touchfield {

namespace {

struct StudyCommand {
  std::string scene;
  std::string output;  // empty: results/runs/NAME_study-NNNN
  std::vector<std::string> overrides;
  bool force = false;
  StudyOptions options;
  std::optional<double> budget;  // [s]
  std::optional<double> error;   // [%]
  PictureFormat pictures = PictureFormat::kPng;
};

/// What to write into a scene to get a rung.
std::string settings_of(const StudyRung& rung, bool has_edge) {
  const char* solver = rung.solver == to_string(SolverKind::kLu)      ? "lu"
                       : rung.solver == to_string(SolverKind::kGmres) ? "gmres"
                       : rung.solver == to_string(SolverKind::kFft)   ? "fft"
                                                                      : "matrix_free";
  return fmt::format("--set solve.scheme={} --set solve.solver={} --set solve.precision={}{}", rung.scheme, solver,
                     rung.precision == "double" ? "double" : "single",
                     has_edge ? fmt::format(" --set body.edge_mm={:.4g}", rung.edge_mm) : "");
}

std::optional<std::size_t> pick(const StudyCommand& command, const std::vector<StudyRung>& rungs) {
  if (command.budget) {
    return pick_within_seconds(rungs, *command.budget);
  }
  return command.error ? pick_within_error(rungs, *command.error / 100.0) : std::nullopt;
}

std::string describe_pick(const StudyCommand& command, const std::vector<StudyRung>& rungs,
                          const std::optional<std::size_t>& picked, bool has_edge) {
  if (!command.budget && !command.error) {
    return "";
  }
  const std::string rule =
      command.budget ? fmt::format("at most {} s", *command.budget) : fmt::format("at most {} %", *command.error);
  if (!picked) {
    return fmt::format("no way to solve the scene fits {}\n", rule);
  }
  const StudyRung& rung = rungs[*picked];
  return fmt::format("{} with {}: {:.2f} % in {:.2f} s, {:.0f} MiB\n  {}\n",
                     command.budget ? "most accurate" : "cheapest", rule, 100.0 * rung.error_reference, rung.seconds,
                     rung.peak_mib, settings_of(rung, has_edge));
}

int study_command(const StudyCommand& command, const CommonFlags& flags) {
  ClaimedDirectory claimed("study.csv holds the ways that are finished; {} says that others are missing");
  apply_threads(flags);
  ConsoleProgress progress(flags);
  const Scene scene = read_scene(command.scene, command.overrides);
  require_apart(command.output, command.scene, scene);
  // What is wrong with the scene or the options is found before the directory exists.
  std::vector<Model> models = study_models(scene, command.options);
  RunDirectory& directory =
      claimed.claim(command.output, command.force, scene.name + "_study", study_files(command.pictures));
  bool fits = true;
  claimed.fill(progress, [&] {
    progress.log_to(directory.file("study.log"));
    const auto keep = [&](const Study& so_far) { write_study_csv(directory.file("study.csv"), so_far.rungs); };
    const Study study = run_study(scene, std::move(models), command.options, progress, keep);
    const auto picked = pick(command, study.rungs);
    const BodySpec& first = scene.bodies.front();
    const bool one_edge = scene.bodies.size() == 1 && first.edge && !first.edge->graded();
    const std::string report =
        fmt::format("reference: {}, {} faces, edge {:.2f} mm, {:.1f} s\n{}{}", study.reference.scheme,
                    study.reference.faces, 1e3 * study.reference.edge, study.reference.seconds,
                    study_table(study.rungs), describe_pick(command, study.rungs, picked, one_edge));
    write_text_file(directory.file("study.txt"), report);
    draw_study(directory.file("study." + to_string(command.pictures)), scene.name + ": error against time", study.rungs,
               picked, command.pictures);
    directory.publish();
    progress.note(fmt::format("results in {}", directory.path()));
    if (flags.json) {
      const Json json = {{"name", scene.name},
                         {"directory", directory.path()},
                         {"rungs", rung_values(study.rungs)},
                         {"picked", picked ? rung_value(study.rungs[*picked]) : Json()}};
      put(json_text(json, 2) + '\n');
    } else {
      put(report);
    }
    fits = picked || !(command.budget || command.error);
  });
  return fits ? 0 : 1;
}

}  // namespace

void add_study_command(CLI::App& app, Invocation& invocation) {
  const auto study = std::make_shared<StudyCommand>();
  CLI::App* command = app.add_subcommand("study", "Compare the speed and the error of all ways to solve a scene");
  add_scene(command, study->scene, study->overrides);
  add_compute_device(command, study->overrides);
  command
      ->add_option("-o,--output", study->output,
                   "Output directory; default: results/runs/NAME_study-NNNN, the next free number")
      ->type_name(kFolder);
  command->add_flag("--force", study->force, "Replace what the output directory holds");
  add_pictures(command, study->pictures, "Format of the plot; default: png");
  auto* budget = add_number(command, "--budget", study->budget, schema::above(0),
                            "Pick the most accurate way that takes at most this many seconds");
  add_number(command, "--error", study->error, schema::above(0),
             "Pick the fastest way with an error of at most this many percent")
      ->excludes(budget);
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
  finish_command(command, invocation,
                 [study](const Invocation& invoked) { return study_command(*study, invoked.flags); });
}

}  // namespace touchfield
