#pragma once

#include "sim/motion/moving_model.h"
#include "sim/store/motion_data.h"

namespace touchfield {

/// How far what a sensor made of the skin is from the true one: rms over the area of the true faces whose middle is
/// within 25 mm (skin) or 5 mm (patch) of the middle of a box of the target, along their normals to the seen skin
/// (signed_distances) [m]. Nothing without a box, or where no face is that near.
///
/// truth, seen   models at the same instant
SkinOff seen_error(const Model& truth, const Model& seen);

/// How far the middle of the patch that a frame was solved for is from where it really was at the frame's pose_time
/// [m]: what the sensor's error and prediction make of it, along the skin as well as off it, which the distances of
/// SkinOff do not see. NaN for a frame without a target.
double target_off(const MovingModel& truth, const MotionFrame& frame);

}  // namespace touchfield
