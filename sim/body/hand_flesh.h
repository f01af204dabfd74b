#pragma once

#include "sim/body/hand_skeleton.h"
#include "sim/body/implicit_surface.h"

namespace touchfield {

inline constexpr double kLeastHandGap = 2.6e-3;  // [m]; narrower ones merge
inline constexpr double kHandGrid = 1.2e-3;      // [m]: the narrowest gaps stay open only if the first mesh sees them

/// The flesh about the bones: fingers and thumb of the published thickness, the palm with the balls of thumb and
/// little finger, webs between the fingers, the wrist up to 20 mm behind its joint.
SoftBody hand_flesh(const HandSkeleton& hand);

/// The palm and the wrist without the ball of the thumb: the same in every pose.
SoftPart palm_flesh(const HandSkeleton& hand);

/// Whether a finger is bent so far that its end turns back to its base: its inside is filled with flesh.
bool curled(const BoneChain& finger);

}  // namespace touchfield
