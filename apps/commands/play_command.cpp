#include <memory>

#include <fmt/format.h>

#include "apps/commands/claimed_directory.h"
#include "apps/commands/command_line.h"
#include "apps/commands/commands.h"
#include "apps/commands/console_progress.h"
#include "apps/commands/standard_streams.h"
#include "sim/acoustics/array_geometry.h"
#include "sim/core/errors.h"
#include "sim/jobs/play_scene.h"
#include "sim/jobs/sensed_motion.h"
#include "sim/motion/frame_solver.h"
#include "sim/motion/play.h"
#include "sim/run/motion_summary.h"
#include "sim/run/run_text.h"
#include "sim/scene/scene_reader.h"

namespace touchfield {

namespace {

struct PlayCommand {
  std::string scene;
  std::string output;                  // empty: results/runs/NAME-NNNN
  std::vector<std::string> overrides;  // key.path=value
  bool force = false;
  std::optional<PictureFormat> pictures;  // what the scene says if not given
};

int play_command(const PlayCommand& command, const Invocation& invoked) {
  const CommonFlags& flags = invoked.flags;
  ClaimedDirectory claimed(
      "motion.h5 holds the motion up to the last full second that was written; {} says that the rest is missing");
  const int threads = apply_threads(flags);
  keep_freed_memory();
  ConsoleProgress progress(flags);
  // All that can be wrong with the input is found before the output directory exists.
  const Scene scene = read_scene(command.scene, command.overrides);
  if (!scene.motion) {
    throw InputError(
        fmt::format("{}: the scene has no motion: section; `touchfield run` computes a still", command.scene));
  }
  require_apart(command.output, command.scene, scene);
  MotionOptions options{.command_line = invoked.command_line, .threads = threads};
  require_motion_memory(scene);
  const SensedMotion sensed = sensed_motion(within_budget(scene, options.notes, &progress), nullptr, &progress);
  RunDirectory& directory =
      claimed.claim(command.output, command.force, scene.name, motion_files(sensed, command.pictures));
  claimed.fill(progress, [&] {
    progress.log_to(directory.file("play.log"));
    progress.note(first_log_line(scene.name, threads));
    const MovingModel& solved = sensed.solved();
    progress.note(fmt::format("  {:.4g} s with a body of {} faces that {}, {} channels", scene.motion->seconds,
                              solved.first().body.mesh.face_count(),
                              solved.is_rigid() && is_exact(scene.motion->sensor)
                                  ? "keeps its shape"
                                  : "changes its shape or its place relative to others",
                              solved.first().fixed->array.size()));
    progress.note(fmt::format("  array: {}", describe_array(solved.first().fixed->array)));
    progress.note("  the solver sees " + sensor_text(scene.motion->sensor));
    for (const std::string& note : options.notes) {
      progress.remark(note);
    }
    const Motion motion = play_scene(sensed, options, directory, progress, command.pictures);
    directory.publish();
    progress.note(fmt::format("results in {}", directory.path()));
    const Json value = {{"name", motion.name},         {"directory", directory.path()},
                        {"seconds", motion.seconds},   {"methods", method_values(motion)},
                        {"warnings", motion.warnings}, {"notes", motion.notes}};
    put(flags.json ? json_text(value, 2) + '\n'
                   : fmt::format("{}{}", motion_table(motion), flags.quiet ? directory.path() + "\n" : ""));
  });
  return 0;
}

}  // namespace

void add_play_command(CLI::App& app, Invocation& invocation) {
  const auto play = std::make_shared<PlayCommand>();
  CLI::App* command =
      app.add_subcommand("play", "Play the motion of a scene on the clock of its sensor, solver and array");
  command->add_option("SCENE", play->scene, "Scene file (YAML) with a motion")->required()->type_name(kYamlFile);
  add_overrides(command, play->overrides);
  add_compute_device(command, play->overrides);
  command
      ->add_option("-o,--output", play->output,
                   "Output directory; default: results/runs/NAME-NNNN, the next free number")
      ->type_name(kFolder);
  command->add_flag("--force", play->force, "Replace the run that the output directory holds");
  add_pictures(command, play->pictures, "Draw pictures of this format; default: PNG if the scene's write has png");
  finish_command(command, invocation, [play](const Invocation& invoked) { return play_command(*play, invoked); });
}

}  // namespace touchfield
