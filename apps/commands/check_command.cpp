#include <algorithm>
#include <memory>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "apps/commands/command_line.h"
#include "apps/commands/commands.h"
#include "apps/commands/console_progress.h"
#include "apps/commands/standard_streams.h"
#include "sim/assess/accuracy.h"
#include "sim/assess/check.h"
#include "sim/batch/check_scene.h"
#include "sim/batch/sweep_case.h"
#include "sim/core/json_text.h"
#include "sim/motion/play.h"
#include "sim/scene/scene_reader.h"
#include "sim/scene/sweep_reader.h"
#include "sim/solve/named_files.h"

namespace touchfield {

namespace {

struct CheckCommand {
  std::string scene;
  std::vector<std::string> overrides;
  bool resolved = false;
  bool accuracy = false;  // measure the discretisation error on this mesh
};

/// A sweep: how many cases and bodies, and what the first case of each body takes.
int check_sweep(const CheckCommand& command, const CommonFlags& flags) {
  const SweepPlan plan = read_sweep(command.scene, command.overrides);
  const std::vector<Scene> scenes = read_cases(plan);
  require_named_files(scenes);
  const std::vector<int> groups = body_groups(scenes);
  const int bodies = 1 + *std::ranges::max_element(groups);
  nlohmann::ordered_json shown = nlohmann::ordered_json::array();
  double largest = 0;
  std::string text =
      fmt::format("sweep {}: {} cases of {} {}\n", plan.name, scenes.size(), bodies, bodies == 1 ? "body" : "bodies");
  constexpr int kMostShown = 20;
  for (int body = 0; body < std::min(bodies, kMostShown); ++body) {
    const auto first = static_cast<std::size_t>(std::ranges::find(groups, body) - groups.begin());
    const auto sharing = static_cast<int>(std::ranges::count(groups, body));
    const Model model = build_model(scenes[first]);
    const CheckReport report = check_model(model, sharing);
    largest = std::max(largest, report.memory_mib);
    text += fmt::format("  case {} and {} more: {} faces, {} channels, {}; about {:.0f} MiB, and {:.0f} s on its own\n",
                        plan.cases[first].number, sharing - 1, report.faces, report.channels,
                        to_string(report.decision.options.kind), report.memory_mib, report.seconds);
    const Remarks remarks = model_remarks(model);
    for (const std::string& warning : remarks.warnings) {
      text += fmt::format("    warning  {}\n", warning);
    }
    for (const std::string& note : remarks.notes) {
      text += fmt::format("    note     {}\n", note);
    }
    shown.push_back({{"case", plan.cases[first].number},
                     {"sharing", sharing},
                     {"faces", report.faces},
                     {"channels", report.channels},
                     {"solver", to_string(report.decision.options.kind)},
                     {"judged_skin", to_string(judged_extent(model))},
                     {"memory_mib", report.memory_mib},
                     {"seconds", report.seconds},
                     {"warnings", remarks.warnings},
                     {"notes", remarks.notes}});
  }
  if (bodies > kMostShown) {
    text += fmt::format("  and {} more bodies\n", bodies - kMostShown);
  }
  if (flags.json) {
    const nlohmann::ordered_json json = {{"name", plan.name},
                                         {"cases", scenes.size()},
                                         {"bodies", bodies},
                                         {"memory_mib", largest},
                                         {"available_mib", available_memory() / (1024.0 * 1024.0)},
                                         {"first_cases", shown}};
    put(json_text(json, 2) + "\n");
  } else if (!flags.quiet) {
    put(text);
  }
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
  const auto& [model, report, accuracy, motion, on_the_way] = checked;
  if (flags.json) {
    put(fmt::format("{}\n", to_json(checked)));
  } else if (!flags.quiet) {
    put(describe_check(model, report, on_the_way));
    if (motion) {
      put(fmt::format(
          "motion: {} frames per method and {} scores, about {:.0f} s to play, {:.0f} MiB in addition to the still\n",
          motion->frames, motion->scores, motion->seconds, motion->memory_mib));
      put(fmt::format("sensor: the solver sees {}; a sample takes about {:.1f} ms on this machine\n",
                      sensor_text(model.fixed->scene.motion->sensor), 1e3 * motion->sample));
    }
    if (accuracy) {
      put(describe_accuracy(*accuracy, model.body.mesh.mean_edge()));
    }
  }
  require_memory(report);
  if (motion) {
    require_motion_memory(model.fixed->scene);
  }
  return 0;
}

}  // namespace

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

}  // namespace touchfield
