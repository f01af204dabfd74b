#pragma once

#include <functional>
#include <optional>

#include "sim/cameras/hand_template.h"
#include "sim/motion/motion_sensor.h"

namespace touchfield {

/// The scene that is solved where a hand is fitted to images or joints. Its body is the hand that is fitted:
/// motion.sensor.hand, or else the scene's own hand, for images in the mean size. It has the scene's place, edges, cut
/// and target. A body without edges gets WholeSkin::kFar. Only its target moves by itself, and it has no evaluation.
///
/// throws   InputError unless it is one body, a hand. With motion.sensor.hand the body may be another shape, except for
///          a recording. Also if motion.change of a recording names anything but the target
Scene fitted_scene(const Scene& scene);

/// Whether the sensor's hand is somebody's recording, so that nobody knows the true one.
bool is_recording(const MotionSpec::Sensor& sensor);

/// The solving mesh of fitted_scene, carried by the hand that is fitted vertex by vertex.
class FittedSkin {
 public:
  /// throws   InputError as fitted_scene, MovingModel and HandTemplate
  FittedSkin(const Scene& scene, KeptBodies* kept);

  const MovingModel& solved() const { return solved_; }
  /// The hand alone: what tracks it need not see as much of a forearm as the scene has, whose end says nothing of the
  /// hand.
  const HandTemplate& hand() const { return hand_; }

  Seen lost(double seconds) const { return {seconds, solved_.state(seconds), true}; }
  /// carry   places what a carrier of the template holds in the world
  /// returns the skin, or lost where it is no surface
  Seen seen(double seconds, const std::function<void(const HandTemplate::Carrier&, Points&)>& carry) const;

 private:
  MovingModel solved_;
  HandTemplate hand_;
  HandTemplate::Carrier carrier_;
  std::optional<HandTemplate::Carrier> beyond_;  // of the skin that is not solved
};

}  // namespace touchfield
