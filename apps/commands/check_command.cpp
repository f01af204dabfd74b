#include <algorithm>
#include <memory>
#include <utility>

#include "apps/commands/command_line.h"
#include "apps/commands/commands.h"
#include "apps/commands/console_progress.h"
#include "apps/commands/standard_streams.h"
#include "sim/core/require.h"
#include "sim/jobs/check_scene.h"
#include "sim/jobs/sweep_case.h"
#include "sim/jobs/sweep_list.h"
#include "sim/motion/play.h"
#include "sim/run/check.h"
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
  const Json shown = list_cases(input, kMostShown);
  double largest = 0;
  for (const Json& one : shown) {
    const auto reason = one.at("reason").get<std::string>();
    require(reason.empty(), "{}: case {}: {}", input.plan.name, one.at("case").get<int>(), reason);
    largest = std::max(largest, one.at("memory_mib").get<double>());
  }
  print_value({{"name", input.plan.name},
               {"cases", input.scenes.size()},
               {"bodies", 1 + std::ranges::max(body_groups(input.scenes))},
               {"memory_mib", largest},
               {"available_mib", available_memory() / (1024.0 * 1024.0)},
               {"first_cases", shown}},
              flags);
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
  print_value(check_value(checked), flags);
  require_memory(checked.report);
  if (checked.motion) {
    require_motion_memory(checked.model.fixed->scene);
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
