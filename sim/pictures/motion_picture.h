#pragma once

#include <string>
#include <vector>

#include "sim/pictures/picture_format.h"
#include "sim/run/motion_data.h"

namespace touchfield {

/// A picture of 1200 x 900 pixels with three plots over the time of the motion, one below the other. They show
/// relative_error [%], displacement since the sample [mm] and mean |p| inside the target [Pa]. Each has one line per
/// method through its scores. Lines break where a value was not computed.
///
/// path     where it lands, whole or not at all
/// returns  false if no score has any of the three; nothing is written then
/// throws   InputError if parts of the motion do not fit each other; IoError if it cannot be written
bool draw_motion(const std::string& path, const Motion& motion, PictureFormat format);

/// A strip of 1200 x 900 pixels of |p| on the evaluated skin, with one column per instant and one row per method. All
/// are seen from one place in the array's direction, with one scale of colours. The target is outlined in green. Below
/// each is the relative error of the score at that time, if there is one. The view holds the targets of all instants.
/// If no instant has a target, it holds all of the skin.
///
/// path       where it lands, whole or not at all
/// instants   at least one, with the same methods in the same order
/// throws     InputError if parts of an instant do not fit each other or it has other methods than the first; IoError
///            if it cannot be written
void draw_motion_strip(const std::string& path, const Motion& motion, const std::vector<MotionInstant>& instants,
                       PictureFormat format);

}  // namespace touchfield
