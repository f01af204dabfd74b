#pragma once

#include <vector>

#include "hardware/array_link.h"
#include "sim/acoustics/transducer_array.h"

namespace touchfield {

/// Farthest that a transducer may be from where it is expected [m].
inline constexpr double kAutd3PositionTolerance = 1e-6;

/// The transducers of placed AUTD3 units, unit after unit.
ArrayLayout autd3_layout(const std::vector<UnitPlacement>& units);

/// Where the units of a layout sit.
///
/// The rotation takes x to the way from channel 0 to the last of its row and y to the way from channel 0 to the last
/// row; every transducer must then be within kAutd3PositionTolerance of where autd3_layout puts it, and its axis within
/// 1e-5 rad.
///
/// layout   of AUTD3 units, in any order; devices from 0, channels 0..248 on each
/// returns  one placement a device, in their order
/// throws   InputError naming the unit and transducer that do not fit
std::vector<UnitPlacement> autd3_placements(const ArrayLayout& layout);

}  // namespace touchfield
