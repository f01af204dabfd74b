#pragma once

#include <utility>

#include "sim/core/types.h"
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

}  // namespace support
}  // namespace touchfield
