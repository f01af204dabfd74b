#pragma once

#include <string>

#include "sim/core/types.h"

namespace touchfield {

/// A rigid motion: the anchor (a landmark, or the body's or array's own origin if empty) lands on `at` after a rotation
/// about the anchor, extrinsic about x, y, z.
struct Placement {
  std::string landmark;
  Vector3 at = Vector3::Zero();      // [m]
  Vector3 angles = Vector3::Zero();  // [rad]
};

}  // namespace touchfield
