#include "sim/jobs/check_scene.h"

#include <algorithm>
#include <map>
#include <span>
#include <utility>

#include <nlohmann/json.hpp>

#include "sim/core/errors.h"
#include "sim/jobs/play_scene.h"
#include "sim/jobs/sweep_case.h"

namespace touchfield {

namespace {

void describe(const Scene& scene, int sharing, KeptBodies& bodies, Json& listed) {
  const auto take = [&](const Model& model, const CheckReport& report, double seconds) {
    const Remarks remarks = model_remarks(model);
    listed.update({{"seconds", seconds},
                   {"memory_mib", report.memory_mib},
                   {"faces", report.faces},
                   {"channels", report.channels},
                   {"solver", to_string(report.decision.options.kind)},
                   {"warnings", remarks.warnings},
                   {"notes", remarks.notes}});
  };
  if (scene.motion) {
    const SensedMotion sensed = sensed_motion(scene, &bodies);
    take(sensed.solved().first(), check_model(sensed.solved().first()), expected_cost(sensed).seconds);
  } else {
    const Model model = build_model(scene, &bodies);
    const CheckReport report = check_model(model, sharing);
    take(model, report, report.seconds);
  }
}

}  // namespace

namespace {

/// Does the work; of a system that cannot be solved it keeps a warning.
template <class Work>
void tell(SceneCheck& checked, const Work& work) {
  try {
    work();
  } catch (const NumericalError& error) {
    checked.remarks.warnings.push_back(std::string("broken_system: ") + error.what());
  }
}

}  // namespace

SceneCheck check_scene(const Scene& scene, bool accuracy, Progress& progress) {
  Model model = build_model(scene);
  CheckReport report = check_model(model);
  SceneCheck checked{std::move(model), std::move(report), std::nullopt, std::nullopt, std::nullopt, {}};
  if (accuracy) {
    require_memory(checked.report);
    tell(checked, [&] { checked.accuracy = measure_accuracy(checked.model, progress); });
  }
  if (scene.motion && !scene.sensing) {  // which is of the still alone: `play` refuses it
    require_memory(checked.report);
    const SensedMotion sensed = sensed_motion(scene, nullptr, &progress);
    tell(checked, [&] { checked.motion = expected_cost(sensed, &progress); });
    add((sensed.truth ? *sensed.truth : sensed.solved()).on_the_way(), checked.remarks);
    add({sensor_warnings(*sensed.sensor, scene.motion->sensor.hz), {}}, checked.remarks);
  }
  if (scene.pattern) {
    require_memory(checked.report);
    checked.pattern = pattern_cost(checked.model);
    add({checked.pattern->warnings, {}}, checked.remarks);
  }
  return checked;
}

Json check_value(const SceneCheck& checked) {
  const auto& [model, report, accuracy, motion, pattern, remarks] = checked;
  Json value = check_value(model, report, remarks);
  if (accuracy) {
    add_accuracy(value, *accuracy, model.body.mesh.mean_edge());
  }
  if (motion) {
    value["motion"] = {{"frames", motion->frames},         {"scores", motion->scores},
                       {"seconds", motion->seconds},       {"sensor", sensor_text(model.fixed->scene.motion->sensor)},
                       {"sample_seconds", motion->sample}, {"memory_mib", motion->memory_mib}};
  }
  if (pattern) {
    value["pattern"] = {{"frames", pattern->clock.frames},   {"pass_s", pattern->clock.seconds()},
                        {"faces", pattern->faces},           {"seconds", pattern->seconds},
                        {"memory_mib", pattern->memory_mib}, {"files_mib", pattern->files_mib}};
  }
  return value;
}

Json list_cases(const SweepInput& input, std::optional<std::size_t> bodies) {
  const std::vector<int> groups = body_groups(input.scenes);
  std::map<int, std::vector<std::size_t>> places;  // of the cases of each body, which is meshed once
  for (std::size_t i = 0; i < groups.size(); ++i) {
    places[groups[i]].push_back(i);
  }
  std::map<std::size_t, Json> listed;
  KeptBodies kept;
  for (const auto& [group, of_body] : places) {
    if (bodies && static_cast<std::size_t>(group) >= *bodies) {
      break;
    }
    for (const std::size_t i : std::span(of_body).first(bodies ? 1 : of_body.size())) {
      Json inputs = Json::object();
      for (const SceneChange& change : input.plan.cases[i].changes) {
        inputs[change.path] = change.value;
      }
      Json& one = listed[i] = {{"case", input.plan.cases[i].number},
                               {"name", input.scenes[i].name},
                               {"inputs", inputs},
                               {"sharing", of_body.size()},
                               {"seconds", {}},
                               {"memory_mib", {}},
                               {"faces", {}},
                               {"channels", {}},
                               {"solver", ""},
                               {"warnings", Json::array()},
                               {"notes", Json::array()},
                               {"reason", ""}};
      try {
        describe(input.scenes[i], static_cast<int>(of_body.size()), kept, one);
      } catch (const Error& error) {
        one["reason"] = error.what();
      }
    }
  }
  Json list = Json::array();
  for (auto& [place, one] : listed) {
    list.push_back(std::move(one));
  }
  return list;
}

}  // namespace touchfield
