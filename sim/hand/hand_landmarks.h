#pragma once

#include <string>
#include <vector>

#include "sim/hand/hand_skeleton.h"
#include "sim/hand/implicit_surface.h"

namespace touchfield {

/// Names of a hand's landmarks.
const std::vector<std::string>& hand_landmark_names();

/// Where a landmark of a left hand lies on its skin [m], to 1e-6 m of the flesh's surface. A pad or tip that is
/// pressed into flesh has no skin of its own: its landmark lies on the skin that is nearest to it.
///
/// throws   InputError that lists the names there are
Vector3 landmark_on_skin(const HandSkeleton& skeleton, const SoftBody& flesh, const std::string& name);

}  // namespace touchfield
