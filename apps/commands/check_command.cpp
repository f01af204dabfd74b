#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "apps/commands/commands.h"
#include "sim/run/check.h"
#include "sim/scene/scene_reader.h"

namespace touchfield {

int check_command(const CheckCommand& command, const CommonFlags& flags) {
  apply_threads(flags);
  const Scene scene = read_scene(command.scene, command.overrides);
  if (command.resolved) {
    fmt::print("{}", resolved_yaml(scene));
    return 0;
  }
  const Model model = build_model(scene);
  const CheckReport report = check_model(scene, model);
  if (flags.json) {
    const nlohmann::ordered_json json = {{"name", scene.name},
                                         {"faces", report.faces},
                                         {"channels", report.channels},
                                         {"target_faces", report.target_faces},
                                         {"epw_mean", report.epw_mean},
                                         {"epw_min", report.epw_min},
                                         {"memory_mib", report.memory_mib},
                                         {"available_mib", report.available_mib},
                                         {"seconds", report.seconds},
                                         {"faults", model.report.faults}};
    fmt::print("{}\n", json.dump(2));
  } else if (!flags.quiet) {
    fmt::print("{}", describe_check(scene, model, report));
  }
  require_memory(report);
  return 0;
}

}  // namespace touchfield
