#include "sim/jobs/check_scene.h"

#include <utility>

#include <nlohmann/json.hpp>

#include "sim/jobs/sensed_motion.h"

namespace touchfield {

SceneCheck check_scene(Scene scene, bool accuracy, Progress& progress) {
  const std::vector<std::string> guesses = guess_units(scene);
  Model model = build_model(scene);
  model.plan.warnings.insert(model.plan.warnings.begin(), guesses.begin(), guesses.end());
  CheckReport report = check_model(model);
  SceneCheck checked{std::move(model), std::move(report), std::nullopt, std::nullopt, {}};
  if (accuracy) {
    require_memory(checked.report);
    checked.accuracy = measure_accuracy(checked.model, progress);
  }
  if (scene.motion && !scene.sensing) {  // which is of the still alone: `play` refuses it
    require_memory(checked.report);
    const SensedMotion sensed = sensed_motion(scene, nullptr, &progress);
    checked.motion = expected_cost(sensed, &progress);
    checked.on_the_way = (sensed.truth ? *sensed.truth : sensed.solved()).on_the_way();
  }
  return checked;
}

Json check_value(const SceneCheck& checked) {
  const auto& [model, report, accuracy, motion, on_the_way] = checked;
  Json value = check_value(model, report, on_the_way);
  if (accuracy) {
    add_accuracy(value, *accuracy, model.body.mesh.mean_edge());
  }
  if (motion) {
    value["motion"] = {{"frames", motion->frames},         {"scores", motion->scores},
                       {"seconds", motion->seconds},       {"sensor", sensor_text(model.fixed->scene.motion->sensor)},
                       {"sample_seconds", motion->sample}, {"memory_mib", motion->memory_mib}};
  }
  return value;
}

}  // namespace touchfield
