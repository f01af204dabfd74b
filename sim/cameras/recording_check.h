#pragma once

#include <string>
#include <vector>

#include "sim/cameras/depth_camera.h"

namespace touchfield {

/// Warnings about a recording that can be read but is probably wrong, one or two sentences each. Cameras: two within 1
/// mm of each other, or all within 3 mm of the world's origin (metres for millimetres). Intrinsics: an axis far from
/// the middle of the image, or pixels that are not square (those of another image). Times: images more than 0.5 s or
/// less than 1 ms apart (not in seconds).
///
/// seconds   of the frames, rising
std::vector<std::string> recording_warnings(const std::vector<DepthCamera>& cameras,
                                            const std::vector<double>& seconds);

}  // namespace touchfield
