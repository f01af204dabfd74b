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
#include "sim/batch/sweep_list.h"
#include "sim/core/json_text.h"
#include "sim/core/require.h"
#include "sim/motion/play.h"
#include "sim/scene/scene_reader.h"
#include "sim/scene/sweep_reader.h"

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
  const SweepInput input = read_sweep_input(command.scene, command.overrides);
  constexpr std::size_t kMostShown = 20;
  const std::vector<ListedCase> listed = list_cases(input, kMostShown);
  const int bodies = 1 + std::ranges::max(body_groups(input.scenes));
  double largest = 0;
  nlohmann::ordered_json shown = nlohmann::ordered_json::array();
  std::string text = fmt::format("sweep {}: {} cases of {} {}\n", input.plan.name, input.scenes.size(), bodies,
                                 bodies == 1 ? "body" : "bodies");
  for (const ListedCase& one : listed) {
    require(one.reason.empty(), "{}: case {}: {}", input.plan.name, one.item.number, one.reason);
    largest = std::max(largest, one.cost.memory_mib);
    shown.push_back(nlohmann::ordered_json::parse(to_json(one)));
    text += fmt::format("  case {} and {} more: {} faces, {} channels, {}; about {:.0f} MiB, and {:.0f} s on its own\n",
                        one.item.number, one.sharing - 1, one.cost.faces, one.cost.channels, one.solver,
                        one.cost.memory_mib, one.cost.seconds);
    for (const std::string& line : one.remarks.warnings) {
      text += fmt::format("    warning  {}\n", line);
    }
    for (const std::string& line : one.remarks.notes) {
      text += fmt::format("    note     {}\n", line);
    }
  }
  if (static_cast<std::size_t>(bodies) > listed.size()) {
    text += fmt::format("  and {} more bodies\n", static_cast<std::size_t>(bodies) - listed.size());
  }
  if (flags.json) {
    const nlohmann::ordered_json json = {{"name", input.plan.name},
                                         {"cases", input.scenes.size()},
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
