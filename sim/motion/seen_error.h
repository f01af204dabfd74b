#pragma once

#include "sim/solve/model.h"
#include "sim/store/motion_data.h"

namespace touchfield {

/// How far what a sensor made of the skin is from the true one: rms over the area of the true faces whose middle is within
/// 25 mm (skin) or 5 mm (patch) of the middle of a box of the target, along their normals to the seen skin (signed_distances) [m].
/// Nothing without a box, or where no face is that near.
///
/// truth, seen   models at the same instant
SkinOff seen_error(const Model& truth, const Model& seen);

}  // namespace touchfield
