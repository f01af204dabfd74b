#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "sim/core/rigid_motion.h"
#include "sim/hand/body.h"
#include "sim/hand/tracked_joints.h"

namespace touchfield {

/// Tracked joints (is_tracked), in their order.
inline constexpr Eigen::Index kTrackedJoints = 20;
using JointPoints = Eigen::Matrix<double, 3, kTrackedJoints>;  // [m]

/// Joints of a hand over time.
struct JointRecording {
  std::vector<double> seconds;                     // rising, from any start
  std::vector<std::optional<JointPoints>> joints;  // in the world's frame; none where the hand was lost
};

/// Reads a table with a header and one row per frame; # starts a comment. The columns are time_s and, for each joint,
/// x, y and z, such as index_tip_x. Lengths are in m, or in the unit that the names end with (index_tip_x_mm). Columns
/// of the joints that are not used may be left out. These columns and radii (index_tip_radius) are ignored. A row in
/// which a used joint has no value, or nan, is a frame without a hand. So is a row with all used joints in one place.
///
/// pose     from the tracker's frame to the world's
/// throws   InputError that names the first fault as file:line: what, rule
JointRecording read_joints(const std::string& path, const RigidMotion& pose = {});

/// The joints of a row as text: time_s, which is read past, and x, y, z of all 26 joints [m], with commas between them.
/// A value may be missing.
///
/// throws   InputError saying what the line is and what it must be
std::optional<JointPoints> joints_of_row(std::string_view row, const RigidMotion& pose = {});

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
