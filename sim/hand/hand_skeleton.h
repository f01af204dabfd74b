#pragma once

#include <array>
#include <cstddef>

#include "sim/core/types.h"
#include "sim/hand/hand_pose.h"

namespace touchfield {

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
