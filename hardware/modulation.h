#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <variant>
#include <vector>

namespace touchfield {

/// The carrier is not modulated.
struct StaticModulation {
  bool operator==(const StaticModulation&) const = default;
};

/// The amplitude is multiplied by m(t) = 1 - depth (1 - sin(2 pi frequency t)) / 2, between 1 - depth and 1.
struct SineModulation {
  double frequency = 200;  // [Hz], > 0
  double depth = 1;        // 0 < depth <= 1
  bool operator==(const SineModulation&) const = default;
};

/// The amplitude is multiplied by samples[k] / 255, repeated for ever.
struct SampledModulation {
  std::vector<std::uint8_t> samples;  // 1 or more
  double rate = 4000;                 // [samples/s], > 0
  bool operator==(const SampledModulation&) const = default;
};

using Modulation = std::variant<StaticModulation, SineModulation, SampledModulation>;

/// What a device can do with the amplitude in time.
struct ModulationAbility {
  double rate = 0;                      // [samples/s] of its buffer; 0: it has none
  std::size_t most_samples = 0;         // that the buffer holds
  std::vector<double> own_frequencies;  // [Hz], at one of which its firmware always modulates in full depth; or empty
};

/// "none", "200 Hz sine, depth 1", "20 samples at 4000 Hz".
std::string describe(const Modulation& modulation);

/// The same as a device does it: with the frequency that its firmware has instead of the one asked for.
std::string describe(const Modulation& modulation, const ModulationAbility& ability);

/// The bytes that a buffer is filled with: the fewest samples that hold whole periods.
///
///   static: one sample of 255; sine: round(255 m(k / rate)); samples: themselves
///
/// throws   InputError if a value is out of range, a sine is not below half the rate, no number of samples within the
///          buffer holds whole periods (to 1e-9 of the frequency), or samples are of another rate than the buffer's
std::vector<std::uint8_t> modulation_samples(const Modulation& modulation, const ModulationAbility& ability);

/// Number of the one of the device's own frequencies that is nearest to the sine's.
///
/// device   its name, for the message
/// throws   InputError if the nearest is more than kOwnFrequencyTolerance away, or the depth is not 1
std::size_t own_frequency(const SineModulation& sine, const ModulationAbility& ability, const std::string& device);

/// Share of the frequency asked for by which a device's own may differ.
inline constexpr double kOwnFrequencyTolerance = 0.05;

/// Refuses what a device cannot do.
///
/// device   its name, for the message
/// throws   InputError naming the device and what it can do
void require_ability(const Modulation& modulation, const ModulationAbility& ability, const std::string& device);

}  // namespace touchfield
