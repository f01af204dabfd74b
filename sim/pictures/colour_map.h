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

/// For pressure on the skin: light grey at 0 (bare skin), then orange and red to dark violet at 1, each darker than the
/// last. Outside that range the ends are used, and blue for NaN.
///
/// source   after magma by N. Smith and S. van der Walt, reversed
Colour skin_colour(double fraction);

inline constexpr Colour kNoSkinValue = {110, 175, 220};
inline constexpr Colour kInk = {25, 25, 25};
inline constexpr Colour kPaper = {255, 255, 255};
inline constexpr Colour kNoValue = {150, 150, 150};

}  // namespace touchfield
