#include <optional>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "apps/commands/commands.h"
#include "apps/commands/console_progress.h"
#include "apps/commands/run_json.h"
#include "sim/run/accuracy.h"
#include "sim/run/bodies.h"
#include "sim/run/check.h"
#include "sim/run/warnings.h"
#include "sim/scene/scene_reader.h"

namespace touchfield {

int check_command(const CheckCommand& command, const CommonFlags& flags) {
  apply_threads(flags);
  Scene scene = read_scene(command.scene, command.overrides);
  if (command.resolved) {
    fmt::print("{}", resolved_yaml(scene));
    return 0;
  }
  const std::vector<std::string> guesses = guess_units(scene);
  Model model = build_model(scene);
  model.plan.warnings.insert(model.plan.warnings.begin(), guesses.begin(), guesses.end());
  const CheckReport report = check_model(scene, model);
  std::optional<AccuracyReport> accuracy;
  if (command.accuracy) {
    require_memory(report);
    ConsoleProgress progress(flags.quiet || flags.json);
    accuracy = measure_accuracy(scene, model, progress);
  }
  if (flags.json) {
    nlohmann::ordered_json json = {{"name", scene.name},
                                   {"faces", report.faces},
                                   {"channels", report.channels},
                                   {"target_faces", report.target_faces},
                                   {"epw_mean", report.epw_mean},
                                   {"epw_min", report.epw_min},
                                   {"scheme", to_string(scene.solve.scheme)},
                                   {"solver", to_string(report.decision.options.kind)},
                                   {"precision", precision_name(report.decision.options)},
                                   {"memory_mib", report.memory_mib},
                                   {"available_mib", report.available_mib},
                                   {"seconds", report.seconds},
                                   {"warnings", model_warnings(model)},
                                   {"faults", model.report.faults}};
    if (accuracy) {
      json["accuracy_l2"] = number_or_null(accuracy->body.rms);
      json["accuracy_max"] = number_or_null(accuracy->body.worst);
      json["accuracy_target_l2"] = number_or_null(accuracy->target.rms);
      json["accuracy_target_max"] = number_or_null(accuracy->target.worst);
      json["accuracy_split"] = number_or_null(accuracy->split_body);
      json["accuracy_split_target"] = number_or_null(accuracy->split_target);
      json["accuracy_seconds"] = accuracy->seconds;
    }
    fmt::print("{}\n", json.dump(2));
  } else if (!flags.quiet) {
    fmt::print("{}", describe_check(scene, model, report));
    if (accuracy) {
      fmt::print("{}", describe_accuracy(*accuracy, model.body.mesh.mean_edge()));
    }
  }
  require_memory(report);
  return 0;
}

}  // namespace touchfield
