#pragma once

#include "sim/motion/moving_model.h"
#include "sim/run/motion_data.h"

namespace touchfield {

/// Error of the skin that a sensor saw: rms over the area of the true faces, along their normals to the seen skin
/// (signed_distances) [m]. It counts the faces whose middle is within 25 mm (skin) or 5 mm (patch) of the middle of a
/// target box. Nothing without a box, or where no face is that near.
///
/// truth, seen   models at the same instant
SkinOff seen_error(const Model& truth, const Model& seen);

/// How far the middle of the patch that a frame was solved for is from its true place at the frame's pose_time [m]. It
/// contains the errors of the sensor and of the prediction, along the skin too, which the distances of SkinOff do not
/// see. NaN for a frame without a target.
double target_off(const MovingModel& truth, const MotionFrame& frame);

}  // namespace touchfield
