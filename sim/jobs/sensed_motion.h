#pragma once

#include "sim/motion/motion_sensor.h"

namespace touchfield {

/// The motion of a scene with the sensor that it says.
///
/// kept       meshes of scenes before this one; may be null
/// progress   hears of what takes its time; may be null
/// throws     InputError as MovingModel, FittedSensor and CameraFolder, where the first sample's noise leaves no skin,
///            where the motion continues for longer than recorded images, and of joints that come by a port in
///            simulated time; NotBuiltIn of cameras and joints in a program without them
SensedMotion sensed_motion(const Scene& scene, KeptBodies* kept = nullptr, Progress* progress = nullptr,
                           MotionClock clock = MotionClock::kSimulated);

}  // namespace touchfield
