#pragma once

#include <array>
#include <string>
#include <vector>

#include "sim/body/hand.h"
#include "sim/core/types.h"

namespace touchfield {

/// Angles of a finger's joints [rad], all zero for a finger straight along y. See FingerJoints.
struct FingerAngles {
  double abduction;
  double mcp;
  double pip;
  double dip;
};

/// Angles of the thumb's joints [rad]. See ThumbJoints.
struct ThumbAngles {
  double cmc_flexion;
  double cmc_abduction;
  double cmc_rotation;
  double mcp;
  double ip;
};

struct HandPose {
  std::string name;
  ThumbAngles thumb;
  std::array<FingerAngles, 4> fingers;  // index, middle, ring, little
};

/// The angles of all joints in a row [rad]: the thumb's five in the order of ThumbAngles, then four of each finger, from
/// index to little, in that of FingerAngles.
using JointAngles = Eigen::Matrix<double, 21, 1>;

/// Where a digit's angles begin among them, from thumb to little, and how many there are.
constexpr Eigen::Index first_joint(std::size_t digit) {
  return digit == 0 ? 0 : 1 + 4 * static_cast<Eigen::Index>(digit);
}
constexpr Eigen::Index joint_count(std::size_t digit) { return digit == 0 ? 5 : 4; }

JointAngles joint_angles(const HandPose& pose);

/// The pose with all its joints turned to these angles, in range or not.
HandPose with_angles(HandPose pose, const JointAngles& angles);

/// The ranges of the joints [rad], as FingerJoints and ThumbJoints have them.
struct JointRanges {
  JointAngles least;
  JointAngles most;
};
JointRanges joint_ranges();

/// The poses the hand knows.
const std::vector<HandPose>& hand_pose_table();

/// The pose of this name with the joints that are given turned to their angles.
/// throws   InputError on an unknown name, or an angle out of its joint's range
HandPose hand_pose(const std::string& name, const HandJoints& joints = {});

}  // namespace touchfield
