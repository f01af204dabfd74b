#include "sim/body/hand_pose.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/core/require.h"
#include "sim/core/units.h"

namespace touchfield {

namespace {

/// In degrees.
struct Range {
  double least;
  double most;
};

constexpr Range kThumbFlexion{-25, 35};
constexpr Range kThumbAbduction{-30, 60};
constexpr Range kThumbRotation{-60, 80};
constexpr Range kThumbMcp{-10, 80};
constexpr Range kThumbIp{-15, 80};
constexpr std::array<Range, 4> kAbduction = {{{-15, 42}, {-20, 20}, {-15, 25}, {-15, 45}}};
constexpr Range kMcp{0, 90};
constexpr Range kPip{0, 100};
constexpr Range kDip{-10, 90};

void turn_to(double& angle, const std::optional<double>& wanted, const char* finger, const char* joint,
             const Range& range) {
  if (!wanted) {
    return;
  }
  constexpr double kRounding = 1e-9;  // of degrees turned into radians and back
  const double degrees = *wanted / kDegree;
  require(degrees >= range.least - kRounding && degrees <= range.most + kRounding,
          "hand.joints.{}.{} = {:.6g} degrees must be {} to {} degrees", finger, joint, degrees, range.least,
          range.most);
  angle = *wanted;
}

void turn_to(FingerAngles& angles, const FingerJoints& wanted, const char* finger, const Range& abduction) {
  turn_to(angles.abduction, wanted.abduction, finger, "abduction", abduction);
  turn_to(angles.mcp, wanted.mcp, finger, "mcp", kMcp);
  turn_to(angles.pip, wanted.pip, finger, "pip", kPip);
  turn_to(angles.dip, wanted.dip, finger, "dip", kDip);
}

FingerAngles finger(double abduction, double mcp, double pip, double dip) {
  return {abduction * kDegree, mcp * kDegree, pip * kDegree, dip * kDegree};
}

ThumbAngles thumb(double flexion, double abduction, double rotation, double mcp, double ip) {
  return {flexion * kDegree, abduction * kDegree, rotation * kDegree, mcp * kDegree, ip * kDegree};
}

/// Calls visit(angle, its place in the row) for every joint.
template <class Pose, class Visit>
void for_each_joint(Pose& pose, const Visit& visit) {
  Eigen::Index i = 0;
  for (auto* angle : {&pose.thumb.cmc_flexion, &pose.thumb.cmc_abduction, &pose.thumb.cmc_rotation, &pose.thumb.mcp,
                      &pose.thumb.ip}) {
    visit(*angle, i++);
  }
  for (auto& finger : pose.fingers) {
    for (auto* angle : {&finger.abduction, &finger.mcp, &finger.pip, &finger.dip}) {
      visit(*angle, i++);
    }
  }
}

}  // namespace

JointAngles joint_angles(const HandPose& pose) {
  JointAngles angles;
  for_each_joint(pose, [&](double angle, Eigen::Index i) { angles(i) = angle; });
  return angles;
}

HandPose with_angles(HandPose pose, const JointAngles& angles) {
  for_each_joint(pose, [&](double& angle, Eigen::Index i) { angle = angles(i); });
  return pose;
}

JointRanges joint_ranges() {
  std::vector<Range> ranges = {kThumbFlexion, kThumbAbduction, kThumbRotation, kThumbMcp, kThumbIp};
  for (const Range& abduction : kAbduction) {
    ranges.insert(ranges.end(), {abduction, kMcp, kPip, kDip});
  }
  JointRanges result;
  for (Eigen::Index i = 0; i < result.least.size(); ++i) {
    result.least(i) = ranges[static_cast<std::size_t>(i)].least * kDegree;
    result.most(i) = ranges[static_cast<std::size_t>(i)].most * kDegree;
  }
  return result;
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
  turn_to(pose.thumb.cmc_flexion, joints.thumb.cmc_flexion, "thumb", "cmc_flexion", kThumbFlexion);
  turn_to(pose.thumb.cmc_abduction, joints.thumb.cmc_abduction, "thumb", "cmc_abduction", kThumbAbduction);
  turn_to(pose.thumb.cmc_rotation, joints.thumb.cmc_rotation, "thumb", "cmc_rotation", kThumbRotation);
  turn_to(pose.thumb.mcp, joints.thumb.mcp, "thumb", "mcp", kThumbMcp);
  turn_to(pose.thumb.ip, joints.thumb.ip, "thumb", "ip", kThumbIp);
  turn_to(pose.fingers[0], joints.index, "index", kAbduction[0]);
  turn_to(pose.fingers[1], joints.middle, "middle", kAbduction[1]);
  turn_to(pose.fingers[2], joints.ring, "ring", kAbduction[2]);
  turn_to(pose.fingers[3], joints.little, "little", kAbduction[3]);
  return pose;
}

}  // namespace touchfield
