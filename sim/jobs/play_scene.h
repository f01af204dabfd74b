#pragma once

#include "sim/motion/motion_sensor.h"
#include "sim/motion/play.h"
#include "sim/run/job.h"

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

/// Plays a motion (play_motion) and writes its results. motion.h5, motion.csv and frames.csv are written again after
/// every second of the motion, so that a kill leaves the last whole ones. The evaluated skin is a ParaView series of
/// about 20 frames per second at most. The pictures are a plot over time and a strip.
///
/// sensed     outlives the job
/// options    their functions are the job's own
/// throws     (the job) as play_motion; IoError on a failed write
Job<Motion> play_job(const SensedMotion& sensed, const MotionOptions& options);

}  // namespace touchfield
