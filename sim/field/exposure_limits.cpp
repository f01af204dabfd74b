#include "sim/field/exposure_limits.h"

#include <cmath>
#include <numbers>

namespace touchfield {

namespace {

/// A limit in some bands, numbered by 10 log10 of their middle in Hz: 43 is 20 kHz, 46 is 40 kHz, 50 is 100 kHz.
struct LimitRow {
  ExposureLimit limit;
  int first;
  int last;
};

constexpr const char* kCommittee = "INIRC-IRPA 1984";
constexpr const char* kCanada = "Health Canada 1991";
constexpr const char* kHygienists = "ACGIH 2004";
constexpr const char* kCeiling = "workers, never above";
constexpr const char* kTrade = "industry and commerce";

constexpr LimitRow kLimits[] = {
    {{kCommittee, "public", 70}, 43, 43},   {{kCommittee, "public", 100}, 44, 50},
    {{kCommittee, "workers", 75}, 43, 43},  {{kCommittee, "workers", 110}, 44, 50},
    {{kCanada, kTrade, 75}, 43, 43},        {{kCanada, kTrade, 110}, 44, 47},
    {{kHygienists, kCeiling, 105}, 43, 43}, {{kHygienists, kCeiling, 110}, 44, 44},
    {{kHygienists, kCeiling, 115}, 45, 50},
};

}  // namespace

double sound_level(double amplitude) {
  constexpr double kReference = 20e-6;  // [Pa], rms
  return 20.0 * std::log10(amplitude / (std::numbers::sqrt2 * kReference));
}

std::vector<ExposureLimit> exposure_limits(double frequency) {
  const double band = std::round(10.0 * std::log10(frequency));
  std::vector<ExposureLimit> limits;
  for (const LimitRow& row : kLimits) {
    if (band >= row.first && band <= row.last) {
      limits.push_back(row.limit);
    }
  }
  return limits;
}

}  // namespace touchfield
