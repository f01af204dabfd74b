#include <algorithm>
#include <cmath>
#include <memory>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "apps/commands/claimed_directory.h"
#include "apps/commands/command_line.h"
#include "apps/commands/commands.h"
#include "apps/commands/console_progress.h"
#include "apps/commands/standard_streams.h"
#include "sim/core/json.h"
#include "sim/core/units.h"
#include "sim/jobs/run_model.h"
#include "sim/pictures/plots.h"
#include "sim/run/run_directory.h"
#include "sim/run/study.h"
#include "sim/run/text_table.h"
#include "sim/scene/scene_reader.h"

namespace touchfield {

namespace {

struct StudyCommand {
  std::string scene;
  std::string output;  // empty: results/runs/NAME_study-NNNN
  std::vector<std::string> overrides;
  bool force = false;
  StudyOptions options;
  PictureFormat pictures = PictureFormat::kPng;
};

/// The rungs as the program prints them, and their plot.
Json lines_of(const Study& study) {
  Json lines = Json::array();
  std::ranges::transform(study.rungs, std::back_inserter(lines), rung_value);
  return lines;
}

void draw(const std::string& path, const std::string& name, const Study& study, PictureFormat format) {
  std::vector<PlotPoint> points;
  for (const StudyRung& rung : study.rungs) {
    if (std::isfinite(rung.error_reference)) {
      points.push_back({rung.scheme, rung.edge_mm, 100.0 * rung.error_reference});
    }
  }
  draw_points(path, {name + ": error against mesh and scheme", "edge length [mm]", "error of the pressure [%]"}, points,
              format);
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
  claimed.fill(progress, [&] {
    progress.log_to(directory.file("study.log"));
    const auto keep = [&](const Study& so_far) {
      write_text_file(directory.file("study.csv"), csv_text(rung_value({}), lines_of(so_far)));
    };
    const Study study = run_study(scene, std::move(models), command.options, progress, keep);
    draw(directory.file("study." + to_string(command.pictures)), scene.name, study, command.pictures);
    directory.publish();
    progress.note(fmt::format("results in {}", directory.path()));
    const Json lines = lines_of(study);
    if (flags.json) {
      put(json_text(Json{{"name", scene.name}, {"directory", directory.path()}, {"rungs", lines}}, 2) + '\n');
    } else {
      put(fmt::format("reference: {}\n{}  pareto: no other is both faster and more accurate\n", study.reference,
                      table_text(lines, lines.size())));
    }
  });
  return 0;
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
