#include "sim/jobs/sensed_motion.h"

#include <utility>

#include <fmt/format.h>

#include "sim/core/errors.h"
#ifdef TOUCHFIELD_CAMERAS
#include "sim/cameras/fitted_sensor.h"
#include "sim/cameras/joints_sensor.h"
#endif
#include "sim/motion/loop_clock.h"

namespace touchfield {

#ifdef TOUCHFIELD_CAMERAS

namespace {

void require_covered(const Scene& scene, double seconds, const std::string& recording) {
  if (to_ticks(scene.motion->seconds) > to_ticks(seconds) + 1) {  // times of a recording are rounded to a tick
    throw InputError(fmt::format("motion.seconds = {:g} must be <= {:g}, the length of the recording in {}",
                                 scene.motion->seconds, seconds, recording));
  }
}

/// Sets what cameras or joints see; of simulated cameras, the truth too.
void see_by_cameras(KeptBodies* kept, Progress* progress, MotionClock clock, SensedMotion& motion) {
  const Scene& scene = motion.scene;
  const auto& sight = scene.motion->sensor.sight;
  if (const auto* recorded = std::get_if<RecordedSpec>(&sight)) {
    HandImages images = recorded_images(recorded->folder, progress);
    require_covered(scene, images.seconds, recorded->folder);
    motion.sensor = std::make_unique<FittedSensor>(scene, std::move(images), nullptr, kept);
  } else if (const auto* joints = std::get_if<JointsSpec>(&sight)) {
    if (const int* port = std::get_if<int>(&joints->from)) {
      if (clock == MotionClock::kSimulated) {
        throw InputError(
            fmt::format("motion.sensor.joints.port = {}: joints come by a port only while `touchfield live` "
                        "plays; give the file of a table here",
                        *port));
      }
      motion.sensor = std::make_unique<LiveJointsSensor>(scene, *port, joints->pose, kept);
      return;
    }
    const auto& file = std::get<std::string>(joints->from);
    const JointRecording recording = read_joints(file, joints->pose);
    require_covered(scene, RecordedTimes(recording.seconds).covered(), file);
    motion.sensor = std::make_unique<JointsSensor>(scene, recording, file, kept);
  } else {
    fitted_scene(scene);  // what is wrong with it is said before the true hand is meshed
    motion.truth = std::make_unique<const MovingModel>(scene, kept, progress);
    motion.sensor =
        std::make_unique<FittedSensor>(scene, simulated_images(*motion.truth, kept), motion.truth.get(), kept);
  }
}

}  // namespace

#endif

SensedMotion sensed_motion(const Scene& scene, KeptBodies* kept, Progress* progress,
                           [[maybe_unused]] MotionClock clock) {
  const auto& sight = scene.motion->sensor.sight;
  SensedMotion motion{scene, nullptr, nullptr};
  const auto* noise = std::get_if<SensingNoise>(&sight);
  if (noise == nullptr && !std::holds_alternative<std::monostate>(sight)) {
#ifdef TOUCHFIELD_CAMERAS
    see_by_cameras(kept, progress, clock, motion);
    return motion;
#else
    throw NotBuiltError(
        "motion.sensor: this program was built without depth cameras and tracked joints: configure with "
        "-DTOUCHFIELD_CAMERAS=ON, or give motion.sensor.noise");
#endif
  }
  motion.truth = std::make_unique<const MovingModel>(scene, kept, progress);
  if (noise != nullptr) {
    motion.sensor = std::make_unique<NoisySensor>(*motion.truth, *noise);
    motion.sensor->sample(0, 0.0);  // what it cannot be is found before anything is written
  } else {
    motion.sensor = std::make_unique<ExactSensor>(*motion.truth);
  }
  return motion;
}

}  // namespace touchfield
