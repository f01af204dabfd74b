#include <memory>

#include <fmt/format.h>

#include "apps/commands/commands.h"
#include "apps/commands/job_console.h"
#include "sim/acoustics/array_geometry.h"
#include "sim/core/errors.h"
#include "sim/core/require.h"
#include "sim/core/text.h"
#include "sim/jobs/felt_result.h"
#include "sim/jobs/pattern_scene.h"
#include "sim/jobs/play_scene.h"
#include "sim/jobs/run_model.h"
#include "sim/motion/frame_solver.h"
#include "sim/run/check.h"
#include "sim/run/motion_file.h"
#include "sim/run/run_file.h"
#include "sim/run/run_text.h"
#include "sim/scene/scene_reader.h"

namespace touchfield {

namespace {

struct SceneJob {
  std::string scene;
  std::vector<std::string> overrides;  // key.path=value
  JobOutput output;
  std::string from;          // of run: a run.h5 whose scene is run again instead
  std::optional<int> check;  // of pattern
};

/// The scene of `run`: a file, or the one that a run has kept, whose paths are absolute.
Scene scene_of_run(const SceneJob& command) {
  if (command.from.empty()) {
    return read_scene(command.scene, command.overrides);
  }
  const std::string file = run_file_at(command.from);
  const Run run = read_run_file(file, say_warning);
  require(text_hash(run.scene) == run.provenance.scene_hash,
          "{}: its scene was changed or damaged after the run; give a scene file instead", file);
  return read_scene_text(run.scene, file, "", command.overrides);
}

int run_command(const SceneJob& command, const Invocation& invoked) {
  if (command.scene.empty() && command.from.empty()) {
    throw InputError("run: SCENE is missing: give a scene file, or --from RUN.h5");
  }
  JobConsole console(invoked, "{} says which methods are finished and which are missing");
  const Scene scene = scene_of_run(command);
  require_apart(command.output.directory, command.scene, scene);
  const Model model = build_model(scene);
  const CheckReport report = check_model(model);
  require_memory(report);
  const SolveOptions options{invoked.command_line, console.threads()};
  return console.finish(command.output, run_job(model, options), [&] {
    ConsoleProgress& progress = console.progress();
    progress.detail(first_log_line(scene.name, console.threads()));
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
  });
}

int play_command(const SceneJob& command, const Invocation& invoked) {
  JobConsole console(
      invoked,
      "motion.h5 holds the motion up to the last full second that was written; {} says that the rest is missing");
  keep_freed_memory();
  ConsoleProgress& progress = console.progress();
  const Scene scene = read_scene(command.scene, command.overrides);
  if (!scene.motion) {
    throw InputError(
        fmt::format("{}: the scene has no motion: section; `touchfield run` computes a still", command.scene));
  }
  require_apart(command.output.directory, command.scene, scene);
  MotionOptions options{.command_line = invoked.command_line, .threads = console.threads()};
  require_motion_memory(scene);
  const SensedMotion sensed = sensed_motion(within_budget(scene, options.notes, &progress), nullptr, &progress);
  return console.finish(command.output, play_job(sensed, options), [&] {
    progress.note(first_log_line(scene.name, console.threads()));
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
  });
}

int pattern_command(const SceneJob& command, const Invocation& invoked) {
  JobConsole console(invoked, "the pattern is not written; {} says so");
  const Scene scene = read_scene(command.scene, command.overrides);
  if (!scene.pattern) {
    throw InputError(
        fmt::format("{}: the scene has no pattern: section; `touchfield run` computes a still", command.scene));
  }
  require_apart(command.output.directory, command.scene, scene);
  pattern_clock(*scene.pattern);
  const Model model = build_model(scene);
  const PatternCost cost = pattern_cost(model);
  require_memory(cost);
  const PatternOptions options{
      .command_line = invoked.command_line, .threads = console.threads(), .check = command.check};
  return console.finish(command.output, pattern_job(model, options), [&] {
    console.progress().detail(first_log_line(scene.name, console.threads()));
    console.progress().note(fmt::format("{}: {} faces, {} channels, {} frames; about {} and {:.1f} GiB", scene.name,
                                        model.body.mesh.face_count(), model.fixed->array.size(), cost.clock.frames,
                                        span_text(cost.seconds), cost.memory_mib / 1024.0));
    console.progress().expect(cost.seconds);
  });
}

struct FeltCommand {
  std::string result;   // run.h5 or pattern.h5, or the directory that holds one
  std::string against;  // likewise; empty: none
  std::vector<std::string> overrides;
  JobOutput output;
};

int felt_command(const FeltCommand& command, const Invocation& invoked) {
  JobConsole console(invoked, "nothing is written; {} says so");
  std::vector<std::string> read = {result_file_at(command.result)};
  Felt felt = felt_of_file(read.front(), command.overrides, say_warning);
  std::optional<Felt> against;
  if (!command.against.empty()) {
    read.push_back(result_file_at(command.against));
    against = felt_of_file(read.back(), command.overrides, say_warning);
  }
  require_apart(command.output.directory, read);
  return console.finish(command.output, felt_job(std::move(felt), std::move(against), WriteSpec{}));
}

/// The options that the three have in common.
void add_job_options(CLI::App* command, SceneJob& job) {
  add_overrides(command, job.overrides);
  add_compute_device(command, job.overrides);
  add_output(command, job.output);
}

}  // namespace

void add_run_command(CLI::App& app, Invocation& invocation) {
  const auto run = std::make_shared<SceneJob>();
  CLI::App* command = app.add_subcommand("run", "Compute a scene and write its results");
  auto* scene = command->add_option("SCENE", run->scene, "Scene file (YAML), or the name of a shipped scene")
                    ->type_name(kYamlFile);
  command->add_option("--from", run->from, "Repeat a run: its run.h5, or the directory that holds it")
      ->excludes(scene)
      ->type_name(kH5File);
  add_job_options(command, *run);
  finish_command(command, invocation, [run](const Invocation& invoked) { return run_command(*run, invoked); });
}

void add_play_command(CLI::App& app, Invocation& invocation) {
  const auto play = std::make_shared<SceneJob>();
  CLI::App* command =
      app.add_subcommand("play", "Play the motion of a scene on the clock of its sensor, solver and array");
  command->add_option("SCENE", play->scene, "Scene file (YAML) with a motion, or a shipped scene")
      ->required()
      ->type_name(kYamlFile);
  add_job_options(command, *play);
  finish_command(command, invocation, [play](const Invocation& invoked) { return play_command(*play, invoked); });
}

void add_pattern_command(CLI::App& app, Invocation& invocation) {
  const auto pattern = std::make_shared<SceneJob>();
  CLI::App* command = app.add_subcommand("pattern", "Solve a pattern that repeats on a still hand, frame by frame");
  command->add_option("SCENE", pattern->scene, "Scene file (YAML) with a pattern, or a shipped scene")
      ->required()
      ->type_name(kYamlFile);
  add_job_options(command, *pattern);
  add_whole(command, "--check", pattern->check, schema::at_least(1),
            "Also solve every n-th frame by itself, and compare the errors");
  finish_command(command, invocation,
                 [pattern](const Invocation& invoked) { return pattern_command(*pattern, invoked); });
}

void add_felt_command(CLI::App& app, Invocation& invocation) {
  const auto felt = std::make_shared<FeltCommand>();
  CLI::App* command = app.add_subcommand("felt", "Compute what the skin does under the radiation pressure of a result");
  command->add_option("RESULT", felt->result, "run.h5 or pattern.h5, or the directory that holds it")
      ->required()
      ->type_name(kH5File);
  command->add_option("--against", felt->against, "Another result; its first method is the reference")
      ->type_name(kH5File);
  add_overrides(command, felt->overrides);
  add_output(command, felt->output);
  finish_command(command, invocation, [felt](const Invocation& invoked) { return felt_command(*felt, invoked); });
}

}  // namespace touchfield
