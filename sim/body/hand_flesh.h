#pragma once

#include "sim/body/hand_skeleton.h"
#include "sim/body/implicit_surface.h"

namespace touchfield {

inline constexpr double kHandGrid = 1.2e-3;  // [m]: the narrowest gaps stay open only if the first mesh sees them

/// The flesh about the bones: fingers and thumb of the published thickness, the palm with the balls of thumb and
/// little finger, webs between the fingers, the wrist up to 20 mm behind its joint.
SoftBody hand_flesh(const HandSkeleton& hand);

}  // namespace touchfield
