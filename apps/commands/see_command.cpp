#include <memory>

#include <fmt/format.h>

#include "apps/commands/claimed_directory.h"
#include "apps/commands/command_line.h"
#include "apps/commands/commands.h"
#include "apps/commands/console_progress.h"
#include "apps/commands/standard_streams.h"
#include "sim/cameras/see_scene.h"
#include "sim/core/units.h"
#include "sim/scene/scene_reader.h"

namespace touchfield {

namespace {

struct SeeCommand {
  std::string scene;
  std::string output;                  // empty: results/runs/NAME-NNNN
  std::vector<std::string> overrides;  // key.path=value
  bool force = false;
  PictureFormat pictures = PictureFormat::kPng;
};

Json sights_value(const SeenScene& seen, const std::vector<SightSummary>& sights, const std::string& directory) {
  Json cameras = Json::array();
  for (const SightSummary& sight : sights) {
    cameras.push_back(Json{{"camera", sight.camera},
                           {"pixels", sight.pixels},
                           {"holes", sight.holes},
                           {"nearest_mm", sight.nearest / kMillimetre},
                           {"farthest_mm", sight.farthest / kMillimetre}});
  }
  return {{"name", seen.moving.first().fixed->scene.name},
          {"directory", directory},
          {"frames", seen.frames},
          {"cameras", cameras}};
}

int see_command(const SeeCommand& command, const Invocation& invoked) {
  const CommonFlags& flags = invoked.flags;
  ClaimedDirectory claimed("times.csv lists the frames that are whole; {} says that others are missing");
  const int threads = apply_threads(flags);
  ConsoleProgress progress(flags);
  // All that can be wrong with the input is found before the output directory exists.
  const Scene scene = read_scene(command.scene, command.overrides);
  require_apart(command.output, command.scene, scene);
  const SeenScene seen = seen_scene(scene, &progress);
  RunDirectory& directory =
      claimed.claim(command.output, command.force, scene.name, sight_files(seen, command.pictures));
  claimed.fill(progress, [&] {
    progress.log_to(directory.file("see.log"));
    progress.note(first_log_line(scene.name, threads));
    const std::vector<SightSummary> sights = see_scene(seen, directory, command.pictures, progress);
    directory.publish();
    progress.note(fmt::format("images in {}", directory.path()));
    print_value(sights_value(seen, sights, directory.path()), flags, true);
  });
  return 0;
}

}  // namespace

void add_see_command(CLI::App& app, Invocation& invocation) {
  const auto see = std::make_shared<SeeCommand>();
  CLI::App* command = app.add_subcommand("see", "Write the depth images of a scene's simulated cameras");
  command->add_option("SCENE", see->scene, "Scene file (YAML) with motion.sensor.cameras")
      ->required()
      ->type_name(kYamlFile);
  add_overrides(command, see->overrides);
  command
      ->add_option(
          "-o,--output", see->output,
          "Output directory, for sensor: {recorded: {folder}}; default: results/runs/NAME-NNNN, the next free number")
      ->type_name(kFolder);
  command->add_flag("--force", see->force, "Replace the run that the output directory holds");
  add_pictures(command, see->pictures, "Format of the picture of each camera's view; default: PNG");
  finish_command(command, invocation, [see](const Invocation& invoked) { return see_command(*see, invoked); });
}

}  // namespace touchfield
