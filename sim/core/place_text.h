#pragma once

#include <string>

#include "sim/core/types.h"

namespace touchfield {

/// A point [m] for a message: "(1.2, -3.4, 200.0) mm".
///
/// decimals   of a millimetre
std::string place_text(const Vector3& point, int decimals = 1);

}  // namespace touchfield
