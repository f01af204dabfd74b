#pragma once

#include <optional>
#include <string>
#include <vector>

#include "sim/hand/body.h"

namespace touchfield {

/// The table's name in a folder of recorded images.
inline constexpr const char* kLandmarksFile = "landmarks.csv";

/// Where named points of a hand were over time.
struct LandmarkRecording {
  std::vector<std::string> names;
  std::vector<double> seconds;  // rising
  std::vector<Points> at;       // a row: 3 x names, in the world's frame [m]; NaN for one that is not known

  /// At a time, on the straight line between the rows round it; a row within 0.1 ms is taken as it is. Nothing outside
  /// of them.
  std::optional<Points> between(double time) const;
};

/// The points of a body's landmarks among these names that a recording has.
///
/// returns   3 x names; NaN for those that the body has not
Points landmark_points(const TriangleMesh& mesh, const std::vector<Landmark>& landmarks,
                       const std::vector<std::string>& names);

/// The table: time_s and NAME_x_mm, NAME_y_mm, NAME_z_mm of each name; empty where it is not known.
std::string landmarks_csv(const LandmarkRecording& recording);

/// Reads such a table, of the hand's landmarks (hand_landmark_names), any of them; units as read_number_table has them.
///
/// throws   InputError that names the first fault as file:line: what, rule
LandmarkRecording read_landmarks(const std::string& path);

}  // namespace touchfield
