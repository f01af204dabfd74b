#pragma once

#include <array>
#include <cstdint>

namespace touchfield {

using Colour = std::array<std::uint8_t, 3>;  // red, green, blue

/// Viridis: perceptually uniform, dark blue at 0 to yellow at 1; outside that range its ends, grey for NaN. Within
/// 2/255 of the published map.
///
/// source   N. Smith, S. van der Walt, E. Firing: every eighth of its 256 published colours
Colour viridis(double fraction);

/// Where there is no value.
inline constexpr Colour kInk = {25, 25, 25};
inline constexpr Colour kPaper = {255, 255, 255};
inline constexpr Colour kNoValue = {150, 150, 150};

}  // namespace touchfield
