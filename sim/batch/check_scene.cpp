#include "sim/batch/check_scene.h"

#include <utility>

#include <nlohmann/json.hpp>

#include "sim/core/json_text.h"
#include "sim/core/units.h"
#include "sim/motion/sensed_motion.h"
#include "sim/solve/meshed_body.h"

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

std::string to_json(const SceneCheck& checked) {
  const auto& [model, report, accuracy, motion, on_the_way] = checked;
  Remarks remarks = model_remarks(model);
  add(on_the_way, remarks);
  nlohmann::ordered_json landmarks = nlohmann::ordered_json::object();
  for (const GivenLandmark& landmark : model.plan.landmarks) {
    landmarks[landmark.name] = landmark.off / kMillimetre;
  }
  nlohmann::ordered_json json = {{"name", model.fixed->scene.name},
                                 {"faces", report.faces},
                                 {"channels", report.channels},
                                 {"target_faces", report.target_faces},
                                 {"epw_mean", report.epw_mean},
                                 {"epw_min", report.epw_min},
                                 {"scheme", to_string(model.fixed->scene.solve.scheme)},
                                 {"solver", to_string(report.decision.options.kind)},
                                 {"precision", precision_name(report.decision.options)},
                                 {"judge_faces", report.judge_faces},
                                 {"judged_skin", to_string(judged_extent(model))},
                                 {"memory_mib", report.memory_mib},
                                 {"available_mib", report.available_mib},
                                 {"seconds", report.seconds},
                                 {"note", report.note},
                                 {"mesh_notes", model.plan.notes},
                                 {"landmarks_off_mm", landmarks},
                                 {"warnings", remarks.warnings},
                                 {"notes", remarks.notes},
                                 {"faults", model.fixed->report.faults}};
  if (accuracy) {
    json["accuracy_l2"] = accuracy->body.rms;
    json["accuracy_max"] = accuracy->body.worst;
    json["accuracy_target_l2"] = accuracy->target.rms;
    json["accuracy_target_max"] = accuracy->target.worst;
    json["accuracy_split"] = accuracy->split_body;
    json["accuracy_split_target"] = accuracy->split_target;
    json["accuracy_seconds"] = accuracy->seconds;
  }
  if (motion) {
    json["motion"] = {{"frames", motion->frames},         {"scores", motion->scores},
                      {"seconds", motion->seconds},       {"sensor", sensor_text(model.fixed->scene.motion->sensor)},
                      {"sample_seconds", motion->sample}, {"memory_mib", motion->memory_mib}};
  }
  return json_text(json, 2);  // what is no number as null
}

}  // namespace touchfield
