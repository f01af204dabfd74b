#include <algorithm>
#include <memory>

#include <fmt/format.h>

#include "apps/commands/claimed_directory.h"
#include "apps/commands/command_line.h"
#include "apps/commands/commands.h"
#include "apps/commands/console_progress.h"
#include "apps/commands/standard_streams.h"
#include "sim/acoustics/array_geometry.h"
#include "sim/core/errors.h"
#include "sim/jobs/run_model.h"
#include "sim/run/check.h"
#include "sim/run/run_file.h"
#include "sim/run/run_text.h"
#include "sim/scene/scene_reader.h"

namespace touchfield {

namespace {

struct RunCommand {
  std::string scene;
  std::string from;                    // run.h5 whose scene is run again instead
  std::string output;                  // empty: results/runs/NAME-NNNN
  std::vector<std::string> overrides;  // key.path=value
  bool force = false;
  std::optional<PictureFormat> pictures;  // what the scene says if not given
};

Json run_result(const Run& run, const std::string& directory) {
  Json seconds = Json::object();
  for (const auto& [stage, value] : run.seconds) {
    seconds[stage] = value;
  }
  Json result = {{"name", run.name},
                 {"directory", directory},
                 {"faces", run.mesh.face_count()},
                 {"channels", run.array.size()},
                 {"methods", method_values(run)},
                 {"seconds", seconds},
                 {"warnings", run.warnings},
                 {"notes", run.notes}};
  result.update(levels_value(run));
  return result;
}

/// The scene of the command: a file, or the one that a run has kept, whose paths are absolute.
Scene scene_of(const RunCommand& command) {
  if (command.from.empty()) {
    return read_scene(command.scene, command.overrides);
  }
  const std::string file = run_file_at(command.from);
  return read_scene_text(read_run_file(file, say_warning).scene, file, "", command.overrides);
}

int run_command(const RunCommand& command, const Invocation& invoked) {
  if (command.scene.empty() && command.from.empty()) {
    throw InputError("run: SCENE is missing: give a scene file, or --from RUN.h5");
  }
  const CommonFlags& flags = invoked.flags;
  ClaimedDirectory claimed("{} says which methods are finished and which are missing");
  const int threads = apply_threads(flags);
  ConsoleProgress progress(flags);
  // All that can be wrong with the input is found before the output directory exists.
  const Scene scene = scene_of(command);
  require_apart(command.output, command.scene, scene);
  const Model model = build_model(scene);
  const CheckReport report = check_model(model);
  require_memory(report);

  const std::vector<std::string> files = run_files(scene, command.pictures);
  RunDirectory& directory = claimed.claim(command.output, command.force, scene.name, files);
  claimed.fill(progress, [&] {
    progress.log_to(directory.file("run.log"));
    progress.detail(first_log_line(scene.name, threads));
    progress.detail(fmt::format("  array: {}", describe_array(model.fixed->array)));
    progress.note(fmt::format("{}: {} faces, {} channels, {} methods; about {} and {:.1f} GiB", scene.name,
                              report.faces, report.channels, scene.solve.methods.size(), span_text(report.seconds),
                              report.memory_mib / 1024.0));
    progress.detail(
        fmt::format("  {:.2f} edges per wavelength, {} target faces", report.epw_mean, report.target_faces));
    if (!report.note.empty()) {
      progress.detail(fmt::format("  {}", report.note));
    }
    for (const GivenLandmark& landmark : model.plan.landmarks) {
      progress.note(fmt::format("  landmark {} is {:.2f} mm off the skin", landmark.name, 1e3 * landmark.off));
    }
    progress.expect(report.seconds);
    const Run run = run_model(model, {invoked.command_line, threads}, directory, progress, command.pictures);
    directory.publish();
    progress.note(fmt::format("results in {}", directory.path()));
    for (const std::string& file : files) {
      if (file == "report.html" || file.starts_with("overview.")) {
        progress.note(fmt::format("open {}", directory.file(file)));
      }
    }
    if (flags.json) {
      put(json_text(run_result(run, directory.path()), 2) + '\n');
    } else {
      put(fmt::format("{}{}{}", methods_table(run), levels_text(run), flags.quiet ? directory.path() + "\n" : ""));
    }
  });
  return 0;
}

}  // namespace

void add_run_command(CLI::App& app, Invocation& invocation) {
  const auto run = std::make_shared<RunCommand>();
  CLI::App* command = app.add_subcommand("run", "Compute a scene and write its results");
  auto* scene = command->add_option("SCENE", run->scene, "Scene file (YAML)")->type_name(kYamlFile);
  command->add_option("--from", run->from, "Repeat a run: its run.h5, or the directory that holds it")
      ->excludes(scene)
      ->type_name(kH5File);
  add_overrides(command, run->overrides);
  add_compute_device(command, run->overrides);
  command
      ->add_option("-o,--output", run->output,
                   "Output directory; default: results/runs/NAME-NNNN, the next free number")
      ->type_name(kFolder);
  command->add_flag("--force", run->force, "Replace the run that the output directory holds");
  add_pictures(command, run->pictures, "Draw pictures of this format; default: PNG if the scene's write has png");
  finish_command(command, invocation, [run](const Invocation& invoked) { return run_command(*run, invoked); });
}

}  // namespace touchfield
