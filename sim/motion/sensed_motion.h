#pragma once

#include <memory>

#include "sim/motion/motion_sensor.h"

namespace touchfield {

/// A motion as it is, and what sees it.
struct SensedMotion {
  Scene scene;                               // as it is written
  std::unique_ptr<const MovingModel> truth;  // what is scored; null where nobody knows it
  std::unique_ptr<MotionSensor> sensor;

  const MovingModel& solved() const { return sensor->solved(); }
};

/// Whether time is simulated, or the wall's, when a sensor may see what happens now.
enum class MotionClock { kSimulated, kWall };

/// The motion of a scene with the sensor that it says.
///
/// kept       meshes of scenes before this one; may be null
/// progress   hears of what takes its time; may be null
/// throws     InputError as MovingModel, FittedSensor and CameraFolder, where the first sample's noise leaves no skin,
///            and
///          where the motion continues for longer than recorded images,
///          and of joints that come by a port in simulated time
SensedMotion sensed_motion(const Scene& scene, KeptBodies* kept = nullptr, Progress* progress = nullptr,
                           MotionClock clock = MotionClock::kSimulated);

}  // namespace touchfield
