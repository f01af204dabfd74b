#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "sim/core/rigid_motion.h"
#include "sim/scene/schema.h"

namespace touchfield {

/// At most this many pixels have all cameras of a scene or recording together: a frame of them and the way that each
/// pixel looks take 0.7 GB.
inline constexpr std::int64_t kMostCameraPixels = std::int64_t{1} << 25U;

/// A stereo depth camera that can be simulated: the numbers of its data sheet.
struct CameraModel {
  std::string name;         // as scenes call it
  double across;            // its depth image's field of view at 16 : 9 [rad]; its pixels are square
  double baseline;          // between its two eyes [m]; its second stands to the right of its first
  double widest_disparity;  // that it searches [pixels]: depth from focal length x baseline / it on
};

/// Their nearest depths follow: of the D415 0.44 m at 1280 x 720, where the maker says 0.45 m; of the D405 96 and 48 mm
/// at 1280 x 720 and 640 x 360, where the maker says 100 and 55 mm. The fields of view down at 16 : 9, 39 and 56
/// degrees, are within 2 degrees of the maker's.
///
/// source   Intel RealSense D400 series data sheet (337029)
const std::vector<CameraModel>& camera_models();

/// throws   InputError listing the names there are
const CameraModel& camera_model(const std::string& name);

}  // namespace touchfield

namespace touchfield::schema {

/// A place in the world as {rotation, translation_mm} or {quaternion_wxyz, translation_mm}. A rotation is taken to the
/// nearest one, from which it may differ by 1e-4 in R^T R.
///
/// columns   what messages say of a rotation's columns: "the camera's right, down and forward"
Codec<RigidMotion> rigid_pose_codec(const std::string& columns);

}  // namespace touchfield::schema
