#pragma once

#include <string>
#include <vector>

#include "sim/pictures/picture_format.h"
#include "sim/store/motion_data.h"

namespace touchfield {

/// A picture of 1200 x 900 pixels: relative_error [%], displacement since the sample [mm] and mean |p| inside the
/// target [Pa] over the time of the motion, under each other, one line per method and score. Lines break where a value
/// was not computed.
///
/// path     where it lands, whole or not at all
/// returns  false if no score has any of the three; nothing is written then
/// throws   InputError if parts of the motion do not fit each other; IoError if it cannot be written
bool draw_motion(const std::string& path, const Motion& motion, PictureFormat format);

/// A strip of 1200 x 900 pixels: |p| on the judged skin, one column per instant and one row per method, from one place
/// in the array's direction with one scale of colours, the target outlined in red. Below each the relative error of the
/// score at that time, if there is one. The view holds the targets of all instants, or all of the skin where there is
/// none.
///
/// path       where it lands, whole or not at all
/// instants   at least one, with the same methods in the same order
/// throws     InputError if parts of an instant do not fit each other or it has other methods than the first; IoError
///            if it cannot be written
void draw_motion_strip(const std::string& path, const Motion& motion, const std::vector<MotionInstant>& instants,
                       PictureFormat format);

}  // namespace touchfield
