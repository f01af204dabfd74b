#pragma once

#include <bit>
#include <cmath>
#include <cstdint>
#include <numbers>

namespace touchfield {

/// Sine and cosine without a call or a branch, so that loops over it become SIMD code; the library's functions do not.
template <typename Real>
struct SinCosOf {
  Real sin;
  Real cos;
};
using SinCos = SinCosOf<double>;

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

/// The same in single precision.
///
/// x         |x| < 1e4
/// accuracy  absolute error below 2e-7, beside what rounding x means
inline SinCosOf<float> sincos(float x) {
  constexpr float kTwoOverPi = 0.636619772F;
  constexpr float kHalfPiHigh = 1.5703125F;  // 9 bits, and 10 more: multiples below 2^13 are exact
  constexpr float kHalfPiMiddle = 4.83751297e-4F;
  constexpr float kHalfPiLow = 7.54978942e-8F;
  constexpr float kRound = 12582912.0F;  // 1.5 * 2^23
  const float shifted = x * kTwoOverPi + kRound;
  const float n = shifted - kRound;
  const float t = ((x - n * kHalfPiHigh) - n * kHalfPiMiddle) - n * kHalfPiLow;
  const float t2 = t * t;
  const float s = t + t * t2 * (-1.66666667e-1F + t2 * (8.33333333e-3F + t2 * (-1.98412698e-4F + t2 * 2.75573192e-6F)));
  const float c = 1.0F + t2 * (-0.5F + t2 * (4.16666667e-2F + t2 * (-1.38888889e-3F + t2 * 2.48015873e-5F)));
  const auto quadrant = std::bit_cast<std::uint32_t>(shifted);
  const bool swapped = (quadrant & 1U) != 0;
  const float sine = swapped ? c : s;
  const float cosine = swapped ? s : c;
  const std::uint32_t sine_sign = (quadrant & 2U) << 30U;
  const std::uint32_t cosine_sign = ((quadrant + 1U) & 2U) << 30U;
  return {std::bit_cast<float>(std::bit_cast<std::uint32_t>(sine) ^ sine_sign),
          std::bit_cast<float>(std::bit_cast<std::uint32_t>(cosine) ^ cosine_sign)};
}

/// The step nearest to a phase [rad] of a device that has `levels` of them a turn, round(phase levels / 2 pi) mod
/// levels: the last half step is step 0.
inline int phase_step(double phase, int levels) {
  const double turns = phase / (2.0 * std::numbers::pi);
  const auto step = static_cast<int>(std::floor((turns - std::floor(turns)) * levels + 0.5));
  return step % levels;
}

}  // namespace touchfield
