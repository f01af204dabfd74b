#include "sim/batch/sweep_list.h"

#include <algorithm>
#include <map>
#include <span>

#include <nlohmann/json.hpp>

#include "sim/assess/check.h"
#include "sim/core/errors.h"
#include "sim/motion/sensed_motion.h"

namespace touchfield {

namespace {

void describe(const Scene& scene, KeptBodies& bodies, ListedCase& listed) {
  const auto take = [&](const Model& model, const CheckReport& report, double seconds) {
    listed.cost = {report.faces, report.channels, report.memory_mib, report.available_mib, seconds};
    listed.solver = to_string(report.decision.options.kind);
    listed.judged_skin = to_string(judged_extent(model));
    listed.remarks = model_remarks(model);
  };
  if (scene.motion) {
    const SensedMotion sensed = sensed_motion(scene, &bodies);
    take(sensed.solved().first(), check_model(sensed.solved().first()), expected_cost(sensed).seconds);
  } else {
    const Model model = build_model(scene, &bodies);
    const CheckReport report = check_model(model, listed.sharing);
    take(model, report, report.seconds);
  }
}

}  // namespace

std::vector<ListedCase> list_cases(const SweepInput& input, std::optional<std::size_t> bodies) {
  const std::vector<int> groups = body_groups(input.scenes);
  std::map<int, std::vector<std::size_t>> places;  // of the cases of each body, which is meshed once
  for (std::size_t i = 0; i < groups.size(); ++i) {
    places[groups[i]].push_back(i);
  }
  std::vector<ListedCase> listed;
  KeptBodies kept;
  for (const auto& [group, of_body] : places) {
    if (bodies && static_cast<std::size_t>(group) >= *bodies) {
      break;
    }
    for (const std::size_t i : std::span(of_body).first(bodies ? 1 : of_body.size())) {
      ListedCase& one =
          listed.emplace_back(ListedCase{input.plan.cases[i], input.scenes[i].name, static_cast<int>(of_body.size())});
      try {
        describe(input.scenes[i], kept, one);
      } catch (const Error& error) {
        one.reason = error.what();
      }
    }
  }
  std::ranges::sort(listed, {}, [](const ListedCase& one) { return one.item.number; });
  return listed;
}

Json case_value(const ListedCase& listed) {
  Json inputs = Json::object();
  for (const SceneChange& change : listed.item.changes) {
    inputs[change.path] = change.value;
  }
  const auto known = [&](const Json& number) { return listed.reason.empty() ? number : Json(); };
  return {{"case", listed.item.number},
          {"name", listed.name},
          {"inputs", inputs},
          {"sharing", listed.sharing},
          {"seconds", known(listed.cost.seconds)},
          {"memory_mib", known(listed.cost.memory_mib)},
          {"faces", known(listed.cost.faces)},
          {"channels", known(listed.cost.channels)},
          {"solver", listed.solver},
          {"judged_skin", listed.judged_skin},
          {"warnings", listed.remarks.warnings},
          {"notes", listed.remarks.notes},
          {"reason", listed.reason}};
}

}  // namespace touchfield
