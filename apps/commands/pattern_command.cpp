#include <memory>

#include <fmt/format.h>

#include "apps/commands/claimed_directory.h"
#include "apps/commands/command_line.h"
#include "apps/commands/commands.h"
#include "apps/commands/console_progress.h"
#include "sim/core/errors.h"
#include "sim/jobs/pattern_scene.h"
#include "sim/scene/scene_reader.h"

namespace touchfield {

namespace {

struct PatternCommand {
  std::string scene;
  std::string output;                  // empty: results/runs/NAME-NNNN
  std::vector<std::string> overrides;  // key.path=value
  bool force = false;
  std::optional<int> check;
  std::optional<PictureFormat> pictures;  // what the scene says if not given
};

int pattern_command(const PatternCommand& command, const Invocation& invoked) {
  const CommonFlags& flags = invoked.flags;
  ClaimedDirectory claimed("the pattern is not written; {} says so");
  const int threads = apply_threads(flags);
  ConsoleProgress progress(flags);
  const Scene scene = read_scene(command.scene, command.overrides);
  if (!scene.pattern) {
    throw InputError(
        fmt::format("{}: the scene has no pattern: section; `touchfield run` computes a still", command.scene));
  }
  require_apart(command.output, command.scene, scene);
  pattern_clock(*scene.pattern);
  const Model model = build_model(scene);
  RunDirectory& directory =
      claimed.claim(command.output, command.force, scene.name, pattern_files(scene, command.pictures));
  claimed.fill(progress, [&] {
    progress.log_to(directory.file("pattern.log"));
    progress.detail(first_log_line(scene.name, threads));
    progress.note(
        fmt::format("{}: {} faces, {} channels", scene.name, model.body.mesh.face_count(), model.fixed->array.size()));
    const PatternOptions options{.command_line = invoked.command_line, .threads = threads, .check = command.check};
    const Pattern pattern = run_pattern(model, options, directory, progress, command.pictures);
    directory.publish();
    progress.note(fmt::format("results in {}", directory.path()));
    Json value = {{"name", pattern.motion.name}, {"directory", directory.path()}};
    value.update(pattern_value(pattern));
    if (flags.json) {  // people have been told while it ran
      value["warnings"] = pattern.motion.warnings;
      value["notes"] = pattern.motion.notes;
    }
    print_value(value, flags, true);
  });
  return 0;
}

}  // namespace

void add_pattern_command(CLI::App& app, Invocation& invocation) {
  const auto pattern = std::make_shared<PatternCommand>();
  CLI::App* command = app.add_subcommand("pattern", "Solve a pattern that repeats on a still hand, frame by frame");
  command->add_option("SCENE", pattern->scene, "Scene file (YAML) with a pattern")->required()->type_name(kYamlFile);
  add_overrides(command, pattern->overrides);
  add_compute_device(command, pattern->overrides);
  command
      ->add_option("-o,--output", pattern->output,
                   "Output directory; default: results/runs/NAME-NNNN, the next free number")
      ->type_name(kFolder);
  command->add_flag("--force", pattern->force, "Replace the run that the output directory holds");
  add_whole(command, "--check", pattern->check, schema::at_least(1),
            "Also solve every n-th frame by itself, and compare the errors");
  add_pictures(command, pattern->pictures, "Draw a picture of this format; default: PNG if the scene's write has png");
  finish_command(command, invocation,
                 [pattern](const Invocation& invoked) { return pattern_command(*pattern, invoked); });
}

}  // namespace touchfield
