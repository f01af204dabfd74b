#pragma once

#include <string>
#include <vector>

#include "sim/hand/hand_pose.h"
#include "sim/hand/implicit_surface.h"

namespace touchfield {

inline constexpr double kLeastHandGap = 2.6e-3;  // [m]; narrower ones merge
inline constexpr double kHandStub = 20e-3;       // [m], from the wrist joint to the end of the hand's own skin
inline constexpr double kHandGrid = 1.2e-3;      // [m]: the narrowest gaps stay open only if the first mesh sees them

/// The flesh about the bones. Fingers and thumb have the published thickness. The palm has the balls of thumb and
/// little finger, and webs lie between the fingers. The wrist reaches up to 20 mm behind its joint. Beyond that there
/// is a forearm.
///
/// forearm   its length from there on [m], >= 0. Its sections are hulls of two equal circles, as the wrist's is.
///           From there on girth and thickness over width grow by a smooth step from 1.83 hand breadths b and 0.61 to
///           3.45 b and 0.86 at 1.02 hand lengths behind the wrist joint. At the elbow, 1.36 lengths behind it, the
///           girth has fallen to 0.93 of that; beyond, it stays. The end is rounded
/// source    ANSUR II (Gordon et al. 2014; 4,082 men, 1,986 women), means: forearm circumference, flexed 310.1 and
///           264.1 mm, 3.51 and 3.38 b; wrist circumference 175.9 and 154.8 mm, 1.99 and 1.98 b; radiale to stylion
///           267.9 and 241.3 mm, 1.39 and 1.33 lengths. The change of these along the forearm, and the thickness, are
///           assumptions
SoftBody hand_flesh(const HandSkeleton& hand, double forearm = 0);

/// The palm and the wrist without the ball of the thumb: the same in every pose.
SoftPart palm_flesh(const HandSkeleton& hand);

/// Whether a finger is bent so far that its end turns back to its base: its inside is filled with flesh.
bool curled(const BoneChain& finger);

const std::vector<std::string>& hand_landmark_names();

/// Where a landmark of a left hand lies on its skin [m], to 1e-6 m of the flesh's surface. A pad or tip that is
/// pressed into flesh has no skin of its own: its landmark lies on the skin that is nearest to it.
///
/// throws   InputError that lists the names there are
Vector3 landmark_on_skin(const HandSkeleton& skeleton, const SoftBody& flesh, const std::string& name);

}  // namespace touchfield
