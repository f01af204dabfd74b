#pragma once

#include <bit>
#include <cstdint>

namespace touchfield {

/// Sine and cosine without a call or a branch, so that loops over it become SIMD code; the library's functions do not.
struct SinCos {
  double sin;
  double cos;
};

/// x         |x| < 1e5
/// accuracy  absolute error below 4e-16 (1 + |x| / 1e5)
/// method    reduction by multiples of pi/2 held in two parts (Cody and Waite), then Taylor series up to the 16th
///           power on |t| <= pi/4, whose next terms are below 5e-17
inline SinCos sincos(double x) {
  constexpr double kTwoOverPi = 0.63661977236758134308;
  constexpr double kHalfPiHigh = 1.57079632673412561417;     // 33 bits: multiples below 2^20 are exact
  constexpr double kHalfPiLow = 6.07710050650619224932e-11;  // pi/2 minus the above
  constexpr double kRound = 6755399441055744.0;              // 1.5 * 2^52: adding it leaves an integer in the last bits
  const double shifted = x * kTwoOverPi + kRound;
  const double n = shifted - kRound;
  const double t = (x - n * kHalfPiHigh) - n * kHalfPiLow;
  const double t2 = t * t;
  const double s =
      t + t * t2 *
              (-1.0 / 6 +
               t2 * (1.0 / 120 +
                     t2 * (-1.0 / 5040 +
                           t2 * (1.0 / 362880 +
                                 t2 * (-1.0 / 39916800 + t2 * (1.0 / 6227020800.0 - t2 * (1.0 / 1307674368000.0)))))));
  const double c =
      1.0 +
      t2 * (-1.0 / 2 +
            t2 * (1.0 / 24 +
                  t2 * (-1.0 / 720 +
                        t2 * (1.0 / 40320 + t2 * (-1.0 / 3628800 +
                                                  t2 * (1.0 / 479001600.0 + t2 * (-1.0 / 87178291200.0 +
                                                                                  t2 * (1.0 / 20922789888000.0))))))));
  const auto quadrant = std::bit_cast<std::uint64_t>(shifted);
  const bool swapped = (quadrant & 1U) != 0;
  const double sine = swapped ? c : s;
  const double cosine = swapped ? s : c;
  // sin changes sign in quadrants 2 and 3, cos in 1 and 2: move that bit to the sign's place.
  const std::uint64_t sine_sign = (quadrant & 2U) << 62U;
  const std::uint64_t cosine_sign = ((quadrant + 1U) & 2U) << 62U;
  return {std::bit_cast<double>(std::bit_cast<std::uint64_t>(sine) ^ sine_sign),
          std::bit_cast<double>(std::bit_cast<std::uint64_t>(cosine) ^ cosine_sign)};
}

}  // namespace touchfield
