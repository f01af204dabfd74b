#pragma once

#include <string>
#include <vector>

#include "sim/cameras/depth_camera.h"

namespace touchfield {

/// At most this many cameras stand in a file.
inline constexpr std::size_t kMostCameras = 8;

/// Cameras as the text of a file cameras.yaml (docs/cameras.md). Its centre counts from the middle of the upper left
/// pixel, as in OpenCV and RealSense's library: cx = centre_u - 0.5.
std::string cameras_text(const std::vector<DepthCamera>& cameras);

/// The cameras of such a text; `near` is 10 mm. A rotation is taken to the nearest one, from which it may differ by
/// 1e-4 in R^T R.
///
/// path     what messages call it
/// throws   InputError naming file, line, field, value and rule: what is missing, unknown or out of range, no rotation,
///          a distortion that cannot be undone within the image, more than kMostCameraPixels together
std::vector<DepthCamera> read_cameras_text(const std::string& text, const std::string& path);

}  // namespace touchfield
