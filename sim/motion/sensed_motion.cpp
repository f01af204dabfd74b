#include "sim/motion/sensed_motion.h"

#include <utility>

#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/motion/fitted_sensor.h"
#include "sim/motion/joints_sensor.h"
#include "sim/motion/live_joints_sensor.h"
#include "sim/motion/loop_clock.h"

namespace touchfield {

namespace {

void require_covered(const Scene& scene, double seconds, const std::string& recording) {
  if (to_ticks(scene.motion->seconds) > to_ticks(seconds) + 1) {  // times of a recording are rounded to a tick
    throw InputError(fmt::format("motion.seconds = {:g} must be <= {:g}, the length of the recording in {}",
                                 scene.motion->seconds, seconds, recording));
  }
}

}  // namespace

SensedMotion sensed_motion(const Scene& scene, KeptBodies* kept, Progress* progress, MotionClock clock) {
  const auto& sight = scene.motion->sensor.sight;
  SensedMotion motion{scene, nullptr, nullptr};
  if (const auto* recorded = std::get_if<RecordedSpec>(&sight)) {
    HandImages images = recorded_images(recorded->folder, progress);
    require_covered(scene, images.seconds, recorded->folder);
    motion.sensor = std::make_unique<FittedSensor>(scene, std::move(images), nullptr, kept);
    return motion;
  }
  if (const auto* joints = std::get_if<JointsSpec>(&sight)) {
    if (const int* port = std::get_if<int>(&joints->from)) {
      if (clock == MotionClock::kSimulated) {
        throw InputError(
            fmt::format("motion.sensor.joints.port = {}: joints come by a port only while `touchfield live` "
                        "plays; give the file of a table here",
                        *port));
      }
      motion.sensor = std::make_unique<LiveJointsSensor>(scene, *port, joints->pose, kept);
      return motion;
    }
    const auto& file = std::get<std::string>(joints->from);
    const JointRecording recording = read_joints(file, joints->pose);
    require_covered(scene, RecordedTimes(recording.seconds).covered(), file);
    motion.sensor = std::make_unique<JointsSensor>(scene, recording, file, kept);
    return motion;
  }
  if (std::holds_alternative<std::vector<CameraSpec>>(sight)) {
    fitted_scene(scene);  // what is wrong with it is said before the true hand is meshed
  }
  motion.truth = std::make_unique<const MovingModel>(scene, kept, progress);
  if (const auto* noise = std::get_if<SensingNoise>(&sight)) {
    motion.sensor = std::make_unique<NoisySensor>(*motion.truth, *noise);
    motion.sensor->sample(0, 0.0);  // what it cannot be is found before anything is written
  } else if (std::holds_alternative<std::vector<CameraSpec>>(sight)) {
    motion.sensor =
        std::make_unique<FittedSensor>(scene, simulated_images(*motion.truth, kept), motion.truth.get(), kept);
  } else {
    motion.sensor = std::make_unique<ExactSensor>(*motion.truth);
  }
  return motion;
}

}  // namespace touchfield
