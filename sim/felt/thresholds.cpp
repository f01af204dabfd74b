#include "sim/felt/thresholds.h"

#include <cmath>

#include "sim/core/require.h"

namespace touchfield {

namespace {

constexpr double kLeastPacinian = 40.0;  // [Hz]
constexpr double kBestPacinian = 250.0;
constexpr double kMostPacinian = 500.0;
constexpr double kLeastRapidlyAdapting = 10.0;
constexpr double kFall = 12.0;  // [dB per octave]
constexpr double kRise = 9.0;

}  // namespace

std::optional<double> relative_threshold(TouchChannel channel, double hz) {
  require(hz > 0.0, "threshold: the frequency must be positive, not {:g} Hz", hz);
  if (channel == TouchChannel::kRapidlyAdapting) {
    if (hz < kLeastRapidlyAdapting || hz > kLeastPacinian) {
      return std::nullopt;
    }
    return kFall * std::log2(kBestPacinian / kLeastPacinian);
  }
  if (hz < kLeastPacinian || hz > kMostPacinian) {
    return std::nullopt;
  }
  return hz < kBestPacinian ? kFall * std::log2(kBestPacinian / hz) : kRise * std::log2(hz / kBestPacinian);
}

}  // namespace touchfield
