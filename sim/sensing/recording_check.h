#pragma once

#include <string>
#include <vector>

#include "sim/sensing/depth_camera.h"

namespace touchfield {

/// What of a recording can be read and is hardly meant, a sentence or two each: cameras of which two stand within 1 mm
/// of each other, or all within 3 mm of the world's origin (metres for millimetres); the axis far from the image's
/// middle or pixels that are not square (intrinsics of another image); images more than 0.5 s or less than 1 ms apart
/// (no seconds).
///
/// seconds   of the frames, rising
std::vector<std::string> recording_warnings(const std::vector<DepthCamera>& cameras,
                                            const std::vector<double>& seconds);

}  // namespace touchfield
