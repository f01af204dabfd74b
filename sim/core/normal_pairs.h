#pragma once

#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <random>

namespace touchfield {

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
