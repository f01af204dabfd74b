#pragma once

#include <string>

#include "sim/core/rigid_motion.h"
#include "sim/scene/schema.h"

namespace touchfield::schema {

/// A place in the world as {rotation, translation_mm} or {quaternion_wxyz, translation_mm}. A rotation is taken to the
/// nearest one, from which it may differ by 1e-4 in R^T R.
///
/// columns   what messages say of a rotation's columns: "the camera's right, down and forward"
Codec<RigidMotion> rigid_pose_codec(const std::string& columns);

}  // namespace touchfield::schema
