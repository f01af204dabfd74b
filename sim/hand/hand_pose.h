#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "sim/core/types.h"

namespace touchfield {

enum class HandSide { kRight, kLeft };

constexpr HandSide other_side(HandSide side) { return side == HandSide::kRight ? HandSide::kLeft : HandSide::kRight; }
constexpr const char* side_name(HandSide side) { return side == HandSide::kRight ? "right" : "left"; }

/// Angles of a finger's joints [rad] that differ from the pose's. Ranges: hand_joints().
struct FingerJoints {
  std::optional<double> abduction;  // away from the middle finger; the middle finger's: towards the thumb
  std::optional<double> mcp;        // knuckle, flexion
  std::optional<double> pip;
  std::optional<double> dip;
};

/// Angles of the thumb's joints [rad] that differ from the pose's.
///
/// The metacarpal points along y, turned twice. The first turn is by 20 degrees - cmc_flexion about the normal z of the
/// back of the hand, away from the index finger. The second is by cmc_abduction out of the plane of the palm.
struct ThumbJoints {
  std::optional<double> cmc_flexion;    // across the palm
  std::optional<double> cmc_abduction;  // out of the palm's plane, palmwards
  std::optional<double> cmc_rotation;   // of the metacarpal about itself: 0 has the pad face the little finger, so that
                                        // the thumb flexes within the palm's plane; towards 80 degrees it faces the
                                        // fingertips (opposition), towards -60 the palm side
  std::optional<double> mcp;            // flexion
  std::optional<double> ip;
};

struct HandJoints {
  ThumbJoints thumb;
  FingerJoints index;
  FingerJoints middle;
  FingerJoints ring;
  FingerJoints little;
};

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

/// The angles of all joints in a row [rad]. The thumb's five come first, in the order of ThumbAngles. Then follow four
/// per finger, from index to little, in the order of FingerAngles.
using JointAngles = Eigen::Matrix<double, 21, 1>;

/// Where a digit's angles begin among them, from thumb to little, and how many there are.
constexpr Eigen::Index first_joint(std::size_t digit) {
  return digit == 0 ? 0 : 1 + 4 * static_cast<Eigen::Index>(digit);
}
constexpr Eigen::Index joint_count(std::size_t digit) { return digit == 0 ? 5 : 4; }

JointAngles joint_angles(const HandPose& pose);

/// The pose with all its joints turned to these angles, in range or not.
HandPose with_angles(HandPose pose, const JointAngles& angles);

/// A joint of the hand, and how far it turns.
struct NamedJoint {
  const char* digit;  // thumb to little
  const char* name;   // cmc_flexion, mcp, ...
  double least;       // [degrees]
  double most;        // [degrees]
};

/// The joints in the order of JointAngles.
const std::array<NamedJoint, 21>& hand_joints();

/// The ranges of the joints [rad].
struct JointRanges {
  JointAngles least;
  JointAngles most;
};
JointRanges joint_ranges();

/// The angle that differs from the pose's, by the joint's place in JointAngles.
const std::optional<double>& joint_in(const HandJoints& joints, Eigen::Index place);
std::optional<double>& joint_in(HandJoints& joints, Eigen::Index place);

const std::vector<HandPose>& hand_pose_table();

/// The pose of this name with the joints that are given turned to their angles.
/// throws   InputError on an unknown name, or an angle out of its joint's range
HandPose hand_pose(const std::string& name, const HandJoints& joints = {});

/// A chain of bones: joints from the base to the end of the skin at the tip. Each bone has the direction that its palm
/// side faces.
struct BoneChain {
  std::array<Vector3, 4> joints;  // finger: MCP, PIP, DIP, tip; thumb: CMC, MCP, IP, tip
  std::array<Vector3, 3> palmar;  // unit, normal to the bone from joint i to i + 1
  std::array<double, 4> radii;    // of the flesh about each joint; the last: of the ball at the tip [m]

  Vector3 along(int bone, double t) const {
    const auto i = static_cast<std::size_t>(bone);
    return joints[i] + t * (joints[i + 1] - joints[i]);
  }
  Vector3 direction(int bone) const {
    const auto i = static_cast<std::size_t>(bone);
    return (joints[i + 1] - joints[i]).normalized();
  }
};

/// A posed left hand in its own frame (see hand.h). A right hand is its mirror image in x.
struct HandSkeleton {
  BoneChain thumb;
  std::array<BoneChain, 4> fingers;
  double length;   // of the hand [m]
  double breadth;  // [m]

  static constexpr std::size_t kDigits = 5;
  /// The thumb, then the fingers from index to little.
  const BoneChain& digit(std::size_t i) const { return i == 0 ? thumb : fingers[i - 1]; }
};

/// What x in a hand's own frame is multiplied by to be x of its skeleton, and the other way round: -1 for a right hand.
constexpr double mirror_sign(HandSide side) { return side == HandSide::kLeft ? 1.0 : -1.0; }

/// Bone lengths scale with the hand's length, thicknesses and distances across it with its breadth.
/// source   Buryanov and Kotiuk 2010 (phalanges, metacarpal of the thumb, soft tissue at the tips)
HandSkeleton posed_skeleton(const HandPose& pose, double length, double breadth);

}  // namespace touchfield
