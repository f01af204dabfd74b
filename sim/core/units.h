#pragma once

#include <numbers>

namespace touchfield {

inline constexpr double kMillimetre = 1e-3;                  // [m]
inline constexpr double kDegree = std::numbers::pi / 180.0;  // [rad]
inline constexpr double kZeroCelsius = 273.15;               // [K]

}  // namespace touchfield
