#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "sim/core/types.h"
#include "sim/hand/hand.h"
#include "sim/hand/hand_pose.h"

namespace touchfield {
inline namespace support {

inline Points mirrored(Points points) {
  points.row(0) *= -1.0;
  return points;
}

/// The bones of a right hand in its own frame: those of posed_skeleton are a left hand's.
inline HandSkeleton right_hand(HandSkeleton left) {
  for (std::size_t i = 0; i < HandSkeleton::kDigits; ++i) {
    BoneChain& chain = i == 0 ? left.thumb : left.fingers[i - 1];
    for (Vector3& joint : chain.joints) {
      joint.x() *= -1.0;
    }
    for (Vector3& palmar : chain.palmar) {
      palmar.x() *= -1.0;
    }
  }
  return left;
}

/// A joint of the hand with the range of its angle.
struct HandJoint {
  std::string name;
  std::function<void(HandJoints&, double)> turn;  // to an angle [rad]
  double least;                                   // [degrees]
  double most;
};

/// The ranges of the design; rotation and the other fingers' abduction are the model's own.
inline std::vector<HandJoint> all_joints() {
  std::vector<HandJoint> joints;
  const auto add_thumb = [&](const char* name, std::optional<double> ThumbJoints::*angle, double least, double most) {
    joints.push_back({std::string("thumb.") + name, [=](HandJoints& j, double a) { j.thumb.*angle = a; }, least, most});
  };
  add_thumb("cmc_flexion", &ThumbJoints::cmc_flexion, -25, 35);
  add_thumb("cmc_abduction", &ThumbJoints::cmc_abduction, -30, 60);
  add_thumb("cmc_rotation", &ThumbJoints::cmc_rotation, -60, 80);
  add_thumb("mcp", &ThumbJoints::mcp, -10, 80);
  add_thumb("ip", &ThumbJoints::ip, -15, 80);
  const auto add_finger = [&](const std::string& name, FingerJoints HandJoints::*finger, double least, double most) {
    const auto add = [&](const char* joint, std::optional<double> FingerJoints::*angle, double low, double high) {
      joints.push_back({name + "." + joint, [=](HandJoints& j, double a) { j.*finger.*angle = a; }, low, high});
    };
    add("abduction", &FingerJoints::abduction, least, most);
    add("mcp", &FingerJoints::mcp, 0, 90);
    add("pip", &FingerJoints::pip, 0, 100);
    add("dip", &FingerJoints::dip, -10, 90);
  };
  add_finger("index", &HandJoints::index, -15, 42);
  add_finger("middle", &HandJoints::middle, -20, 20);
  add_finger("ring", &HandJoints::ring, -15, 25);
  add_finger("little", &HandJoints::little, -15, 45);
  return joints;
}

}  // namespace support
}  // namespace touchfield
