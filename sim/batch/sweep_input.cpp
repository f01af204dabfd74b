#include "sim/batch/sweep_input.h"

#include <algorithm>
#include <utility>
#include <variant>

#include "sim/gpu/gpu_library.h"
#include "sim/scene/sweep_reader.h"
#include "sim/solve/named_files.h"

namespace touchfield {

namespace {

std::vector<Scene> with_sides_exchanged(std::vector<Scene> scenes) {
  for (Scene& scene : scenes) {
    for (BodySpec& body : scene.bodies) {
      if (auto* hand = std::get_if<HandShape>(&body.shape)) {
        hand->side = other_side(hand->side);
      }
    }
    if (scene.motion && scene.motion->sensor.hand) {
      HandShape& hand = *scene.motion->sensor.hand;
      hand.side = other_side(hand.side);
    }
  }
  return scenes;
}

/// What a scene that says nothing of it had: no skin beyond keep_within, the solving model for a judge, and of a judge by
/// edge lengths the whole bodies up to kWholeFaces.
std::vector<Scene> with_earlier_parts(std::vector<Scene> scenes) {
  for (Scene& scene : scenes) {
    for (BodySpec& body : scene.bodies) {
      body.beyond = Beyond::kNothing;
    }
    JudgeSpec& judge = scene.judge;
    if (judge.kind == JudgeSpec::Kind::kAuto) {
      judge.kind = JudgeSpec::Kind::kSame;
    }
    if (judge.kind == JudgeSpec::Kind::kEdge && judge.whole == JudgeSpec::Whole::kUnsaid) {
      judge.whole = JudgeSpec::Whole::kAuto;
    }
  }
  return scenes;
}

bool has_hands(const std::vector<Scene>& scenes) {
  const auto is_hand = [](const BodySpec& body) { return std::holds_alternative<HandShape>(body.shape); };
  return std::ranges::any_of(scenes, [&](const Scene& scene) {
    return std::ranges::any_of(scene.bodies, is_hand) || (scene.motion && scene.motion->sensor.hand);
  });
}

bool means_otherwise(const std::vector<Scene>& scenes) {
  const auto is_part = [](const BodySpec& body) { return body.keep_within.has_value(); };
  return std::ranges::any_of(scenes, [&](const Scene& scene) {
    return std::ranges::any_of(scene.bodies, is_part) || scene.judge.kind == JudgeSpec::Kind::kAuto;
  });
}

}  // namespace

SweepInput read_sweep_input(const std::string& path, const std::vector<std::string>& overrides, Shard shard) {
  SweepPlan plan = read_sweep(path, overrides);
  std::vector<Scene> scenes = read_cases(plan);
  require_named_files(scenes);
  SweepIdentity identity{plan, plan_hash(plan, with_sides_exchanged(scenes)), shard, names_files(scenes)};
  return {std::move(plan), std::move(scenes), std::move(identity)};
}

SweepDirectory open_sweep(SweepInput& input, const std::string& path, bool resume) {
  SweepDirectory directory = SweepDirectory::open(path, input.identity, resume);
  if (directory.has_exchanged_sides()) {
    input.scenes = with_sides_exchanged(std::move(input.scenes));
    if (has_hands(input.scenes)) {
      input.warnings.emplace_back(
          "an earlier version began this sweep, whose side: right was a left hand; cases that are computed now have "
          "the "
          "same hand");
    }
  }
  if (directory.has_earlier_parts()) {
    if (means_otherwise(input.scenes)) {
      input.warnings.emplace_back(
          "an earlier version began this sweep, which left out the skin beyond keep_within_mm and judged by the "
          "solving "
          "model unless told otherwise; cases that are computed now do the same (beyond: nothing, judge: same)");
    }
    input.scenes = with_earlier_parts(std::move(input.scenes));
  }
  if (directory.of_other_defaults()) {
    input.warnings.emplace_back(
        "a version with other defaults began this sweep; cases that are computed now have this version's");
  }
  return directory;
}

void share_cards(const std::vector<Scene>& scenes, SweepOptions& options) {
  const auto device_of = [](const Scene& scene) { return scene.solve.solver.device; };
  const bool on_first_card = std::ranges::all_of(scenes, [&](const Scene& scene) {
    return device_of(scene).kind == ComputeDevice::Kind::kCuda && device_of(scene).card == 0;
  });
  const bool leaves_open = std::ranges::all_of(
      scenes, [&](const Scene& scene) { return device_of(scene).kind == ComputeDevice::Kind::kAuto; });
  if (on_first_card || leaves_open) {
    options.cards = separate_cards();
  }
  if (on_first_card && options.jobs == 0) {  // several processes on one card wait for one another
    options.jobs = std::max(1, static_cast<int>(options.cards.size()));
  }
}

}  // namespace touchfield
