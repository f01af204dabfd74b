#pragma once

#include "sim/bem/everywhere.h"

// Of the coarse space (coarse_space.h), for the processor and the graphics card. Lengths of places (x, s n) in metres.

namespace touchfield {

inline constexpr double kCoarseSpacing = 0.33;      // wavelengths from a face to its nearest point at most
inline constexpr double kCoarseNormalScale = 0.35;  // wavelengths that a turn of the normal by one radian counts
inline constexpr double kCoarseShortest = 1.0;      // of the waves that are interpolated, over k
inline constexpr double kCoarseNugget = 1e-3;
inline constexpr int kCoarseNeighbours = 8;

/// 2 J1(z) / z.
TOUCHFIELD_EVERYWHERE inline double coarse_covariance(double z) { return z < 1e-4 ? 1.0 : 2.0 * j1(z) / z; }

}  // namespace touchfield
