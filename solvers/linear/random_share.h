#pragma once

#include <random>

namespace touchfield {

/// A uniform number 0 <= u < 1 of 53 bits, straight from the generator's: the same with every standard library.
inline double random_share(std::mt19937_64& generator) { return static_cast<double>(generator() >> 11U) * 0x1p-53; }

}  // namespace touchfield
