#pragma once

#include <array>
#include <string>
#include <vector>

#include "sim/core/types.h"

namespace touchfield {

/// Angles of a finger's joints [rad], all zero for a finger straight along y.
struct FingerAngles {
  double abduction;  // of the first joint, towards the thumb
  double lean;       // of the plane of flexion about the metacarpal, towards the thumb's side when flexed
  double mcp;        // flexion, towards the palm
  double pip;
  double dip;
};

/// Angles of the thumb's joints [rad].
struct ThumbAngles {
  double radial;  // of the metacarpal from y, away from the index finger, in the plane of the palm
  double palmar;  // of the metacarpal out of the plane of the palm
  double turn;    // of the plane of flexion about the metacarpal; 0: it flexes across the palm, within its plane
  double mcp;     // flexion
  double ip;
};

struct HandPose {
  std::string name;
  ThumbAngles thumb;
  std::array<FingerAngles, 4> fingers;  // index, middle, ring, little
};

/// The poses the hand knows.
const std::vector<HandPose>& hand_pose_table();

/// A chain of bones: joints from the base to the end of the skin at the tip, and which way its palm side faces at each
/// bone.
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

/// A posed right hand in its own frame (see hand.h).
struct HandSkeleton {
  BoneChain thumb;
  std::array<BoneChain, 4> fingers;
  double length;   // of the hand [m]
  double breadth;  // [m]
};

/// Bone lengths scale with the hand's length, thicknesses and distances across it with its breadth.
/// source   Buryanov and Kotiuk 2010 (phalanges, metacarpal of the thumb, soft tissue at the tips)
HandSkeleton posed_skeleton(const HandPose& pose, double length, double breadth);

}  // namespace touchfield
