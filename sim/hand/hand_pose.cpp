#include "sim/hand/hand_pose.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/core/require.h"
#include "sim/core/units.h"

namespace touchfield {

namespace {

constexpr std::array<NamedJoint, 21> kJoints{{{"thumb", "cmc_flexion", -25, 35},
                                              {"thumb", "cmc_abduction", -30, 60},
                                              {"thumb", "cmc_rotation", -60, 80},
                                              {"thumb", "mcp", -10, 80},
                                              {"thumb", "ip", -15, 80},
                                              {"index", "abduction", -15, 42},
                                              {"index", "mcp", 0, 90},
                                              {"index", "pip", 0, 100},
                                              {"index", "dip", -10, 90},
                                              {"middle", "abduction", -20, 20},
                                              {"middle", "mcp", 0, 90},
                                              {"middle", "pip", 0, 100},
                                              {"middle", "dip", -10, 90},
                                              {"ring", "abduction", -15, 25},
                                              {"ring", "mcp", 0, 90},
                                              {"ring", "pip", 0, 100},
                                              {"ring", "dip", -10, 90},
                                              {"little", "abduction", -15, 45},
                                              {"little", "mcp", 0, 90},
                                              {"little", "pip", 0, 100},
                                              {"little", "dip", -10, 90}}};

FingerAngles finger(double abduction, double mcp, double pip, double dip) {
  return {abduction * kDegree, mcp * kDegree, pip * kDegree, dip * kDegree};
}

ThumbAngles thumb(double flexion, double abduction, double rotation, double mcp, double ip) {
  return {flexion * kDegree, abduction * kDegree, rotation * kDegree, mcp * kDegree, ip * kDegree};
}

/// Where the angles of a thumb and of four fingers are, in their row.
template <class Thumb, class... Fingers>
auto row_of(Thumb& thumb, Fingers&... fingers) {
  std::array<decltype(&thumb.mcp), 21> row{&thumb.cmc_flexion, &thumb.cmc_abduction, &thumb.cmc_rotation, &thumb.mcp,
                                           &thumb.ip};
  auto next = row.begin() + joint_count(0);
  ((next = std::ranges::copy(std::array{&fingers.abduction, &fingers.mcp, &fingers.pip, &fingers.dip}, next).out), ...);
  return row;
}
template <class Pose>
auto pose_row(Pose& pose) {
  return row_of(pose.thumb, pose.fingers[0], pose.fingers[1], pose.fingers[2], pose.fingers[3]);
}
template <class Joints>
auto joints_row(Joints& joints) {
  return row_of(joints.thumb, joints.index, joints.middle, joints.ring, joints.little);
}

}  // namespace

const std::array<NamedJoint, 21>& hand_joints() { return kJoints; }

const std::optional<double>& joint_in(const HandJoints& joints, Eigen::Index place) {
  return *joints_row(joints)[static_cast<std::size_t>(place)];
}
std::optional<double>& joint_in(HandJoints& joints, Eigen::Index place) {
  return *joints_row(joints)[static_cast<std::size_t>(place)];
}

JointAngles joint_angles(const HandPose& pose) {
  JointAngles angles;
  std::ranges::transform(pose_row(pose), angles.begin(), [](const double* angle) { return *angle; });
  return angles;
}

HandPose with_angles(HandPose pose, const JointAngles& angles) {
  const auto row = pose_row(pose);
  for (std::size_t i = 0; i < row.size(); ++i) {
    *row[i] = angles(static_cast<Eigen::Index>(i));
  }
  return pose;
}

JointRanges joint_ranges() {
  JointRanges ranges;
  std::ranges::transform(kJoints, ranges.least.begin(), [](const NamedJoint& joint) { return joint.least * kDegree; });
  std::ranges::transform(kJoints, ranges.most.begin(), [](const NamedJoint& joint) { return joint.most * kDegree; });
  return ranges;
}

const std::vector<HandPose>& hand_pose_table() {
  static const std::vector<HandPose> kPoses = {
      {"flat",
       thumb(-22, 15, -35, 8, 8),
       {finger(7, 3, 4, 3), finger(0, 3, 5, 3), finger(7, 3, 5, 3), finger(15, 4, 5, 3)}},
      {"index_up",
       thumb(-2, 49.5, -12.5, 59, 58),
       {finger(0, 0, 0, 0), finger(0, 80, 95, 50), finger(0, 80, 95, 50), finger(0, 80, 95, 50)}},
      {"grasp",
       thumb(16, 60, 75, 7, -8.5),
       {finger(-4, 36, 17, 10), finger(-7, 41.5, 15.5, 7.5), finger(7.5, 38.5, 16.5, 8.5), finger(12, 28.5, 19, 12)}},
      {"point_down",
       thumb(-2, 49.5, -12.5, 59, 58),
       {finger(0, 8, 10, 6), finger(0, 80, 95, 50), finger(0, 80, 95, 50), finger(0, 80, 95, 50)}},
      {"fist",
       thumb(-15, 58, -15.5, 78, 33),
       {finger(0, 85, 100, 60), finger(0, 85, 100, 60), finger(0, 85, 100, 60), finger(0, 85, 100, 60)}},
  };
  return kPoses;
}

HandPose hand_pose(const std::string& name, const HandJoints& joints) {
  const std::vector<HandPose>& poses = hand_pose_table();
  const auto found = std::find_if(poses.begin(), poses.end(), [&](const HandPose& pose) { return pose.name == name; });
  if (found == poses.end()) {
    std::string known;
    for (const HandPose& pose : poses) {
      known += (known.empty() ? "" : ", ") + pose.name;
    }
    throw InputError(fmt::format("hand.pose = '{}' must be one of {}", name, known));
  }
  HandPose pose = *found;
  const auto angles = pose_row(pose);
  const auto wanted = joints_row(joints);
  for (std::size_t i = 0; i < kJoints.size(); ++i) {
    if (!*wanted[i]) {
      continue;
    }
    constexpr double kRounding = 1e-9;  // of degrees turned into radians and back
    const auto& [digit, name, least, most] = kJoints[i];
    const double degrees = **wanted[i] / kDegree;
    require(degrees >= least - kRounding && degrees <= most + kRounding,
            "hand.joints.{}.{} = {:.6g} degrees must be {} to {} degrees", digit, name, degrees, least, most);
    *angles[i] = **wanted[i];
  }
  return pose;
}

}  // namespace touchfield
