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

}  // namespace

SweepInput read_sweep_input(const std::string& path, const std::vector<std::string>& overrides, Shard shard) {
  SweepPlan plan = read_sweep(path, overrides);
  std::vector<Scene> scenes = read_cases(plan);
  require_named_files(scenes);
  SweepIdentity identity{plan, plan_hash(plan, with_sides_exchanged(scenes)), shard, names_files(scenes),
                         plan_hash(plan, scenes)};
  return {std::move(plan), std::move(scenes), std::move(identity)};
}

SweepDirectory open_sweep(SweepInput& input, const std::string& path, bool resume) {
  SweepDirectory directory = SweepDirectory::open(path, input.identity, resume);
  if (directory.has_exchanged_sides()) {
    input.scenes = with_sides_exchanged(std::move(input.scenes));
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
