#include "sim/cameras/fitted_skin.h"

#include <string>

#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/motion/whole_skin.h"

namespace touchfield {

namespace {

std::string key_of(const MotionSpec::Sensor& sensor) {
  return std::holds_alternative<JointsSpec>(sensor.sight)     ? "motion.sensor.joints"
         : std::holds_alternative<RecordedSpec>(sensor.sight) ? "motion.sensor.recorded"
                                                              : "motion.sensor.cameras";
}

/// The hand that is fitted, before its shape is learnt.
HandShape fitted_hand(const Scene& scene) {
  const MotionSpec::Sensor& sensor = scene.motion->sensor;
  const std::string key = key_of(sensor);
  if (scene.bodies.size() != 1) {
    throw InputError(
        fmt::format("{}: a hand is fitted, but the scene has {} bodies, must have 1", key, scene.bodies.size()));
  }
  const auto* own = std::get_if<HandShape>(&scene.bodies.front().shape);
  if (own == nullptr && (!sensor.hand || is_recording(sensor))) {
    throw InputError(
        fmt::format("{}: a hand is fitted, but the scene's body is not a hand; must be body.hand{}", key,
                    is_recording(sensor) ? "" : ", or motion.sensor.hand must say which hand is to be fitted to it"));
  }
  if (sensor.hand) {
    return *sensor.hand;
  }
  HandShape hand = *own;
  if (!std::holds_alternative<JointsSpec>(sensor.sight)) {
    hand.length = HandShape{}.length;
    hand.breadth = HandShape{}.breadth;
  }
  return hand;
}

HandShape without_forearm(HandShape hand) {
  hand.forearm = 0;
  return hand;
}

}  // namespace

bool is_recording(const MotionSpec::Sensor& sensor) {
  return std::holds_alternative<RecordedSpec>(sensor.sight) || std::holds_alternative<JointsSpec>(sensor.sight);
}

Scene fitted_scene(const Scene& scene) {
  Scene solved = scene;
  BodySpec& body = solved.bodies.front();
  body.shape = fitted_hand(scene);
  if (!body.edge) {
    body.edge.emplace().far = WholeSkin::kFar;
  }
  solved.evaluation.kind = EvaluationSpec::Kind::kNone;
  std::erase_if(solved.motion->changes, [](const MotionChange& change) { return change.path.rfind("target", 0) != 0; });
  const MotionSpec::Sensor& sensor = scene.motion->sensor;
  if (is_recording(sensor) && solved.motion->changes.size() != scene.motion->changes.size()) {
    throw InputError(fmt::format(
        "motion.change: {} {} determine how the hand moves; only the target can change as well",
        std::holds_alternative<JointsSpec>(sensor.sight) ? "the joints of" : "the images of", key_of(sensor)));
  }
  return solved;
}

FittedSkin::FittedSkin(const Scene& scene, KeptBodies* kept)
    : solved_(fitted_scene(scene), kept),
      hand_(without_forearm(std::get<HandShape>(solved_.first().posture.bodies.front().shape)),
            HandTemplate::kUsualEdge),
      carrier_(hand_.carrier(solved_.first().own_frame(solved_.first().body.mesh.vertices()))) {
  if (const SkinPatches& beyond = solved_.first().beyond; !beyond.empty()) {
    beyond_ = hand_.carrier(solved_.first().own_frame(beyond.corners));
  }
}

Seen FittedSkin::seen(double seconds, const std::function<void(const HandTemplate::Carrier&, Points&)>& carry) const {
  Seen seen{seconds, solved_.state(seconds), false};
  carry(carrier_, seen.state.skin.emplace());
  if (beyond_) {
    carry(*beyond_, seen.state.patches.emplace());
  }
  try {
    TriangleMesh(*seen.state.skin, solved_.first().body.mesh.triangles());
  } catch (const InputError&) {
    seen.lost = true;
  }
  return seen;
}

}  // namespace touchfield
