#pragma once

#include <cstdint>

namespace touchfield {

/// 64 bits that look random, made of a number. They are the same everywhere. So values drawn by consecutive numbers
/// depend neither on their order nor on threads. The step and the finaliser of splitmix64.
///
/// source   Steele, Lea and Flood, Fast splittable pseudorandom number generators, OOPSLA 2014
constexpr std::uint64_t mixed_bits(std::uint64_t number) {
  number += 0x9e3779b97f4a7c15;
  number = (number ^ (number >> 30U)) * 0xbf58476d1ce4e5b9;
  number = (number ^ (number >> 27U)) * 0x94d049bb133111eb;
  return number ^ (number >> 31U);
}

/// Uniform in [0, 1), of the upper bits.
constexpr double unit_number(std::uint64_t bits) { return static_cast<double>(bits >> 11U) * 0x1p-53; }

}  // namespace touchfield
