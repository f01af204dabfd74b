#pragma once

#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <random>

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

/// Random numbers of a seed: pairs of independent normal numbers of mean 0 and deviation 1, and uniform ones. The pairs
/// are the same on every machine but for the rounding of log, cos and sin. The uniform ones are the same to the bit.
///
/// source   Box and Muller 1958
class NormalPairs {
 public:
  /// A point of the plane with two independent normal coordinates, in polar form.
  struct Polar {
    double radius;
    double angle;  // [rad]

    double first() const { return radius * std::cos(angle); }
    double second() const { return radius * std::sin(angle); }
  };

  explicit NormalPairs(std::uint64_t seed) : bits_(seed) {}

  Polar next() {
    const double radius = std::sqrt(-2.0 * std::log(uniform()));
    return {radius, 2.0 * std::numbers::pi * uniform()};
  }

  /// Uniform in 0 < u <= 1.
  double uniform() {
    constexpr int kDigits = std::numeric_limits<double>::digits;
    return std::ldexp(static_cast<double>((bits_() >> (64 - kDigits)) + 1), -kDigits);
  }

 private:
  std::mt19937_64 bits_;
};

}  // namespace touchfield
