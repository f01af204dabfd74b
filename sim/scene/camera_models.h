#pragma once

#include <string>
#include <vector>

namespace touchfield {

/// A stereo depth camera that can be simulated: the numbers of its data sheet.
struct CameraModel {
  std::string name;         // as scenes call it
  double across;            // its depth image's field of view at 16 : 9 [rad]
  double down;              // [rad]
  double baseline;          // between its two eyes [m]; its second stands to the right of its first
  double widest_disparity;  // that it searches [pixels]: depth from focal length x baseline / it on
};

/// source   Intel RealSense D400 series data sheet (337029)
const std::vector<CameraModel>& camera_models();

/// throws   InputError listing the names there are
const CameraModel& camera_model(const std::string& name);

}  // namespace touchfield
