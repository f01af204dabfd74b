#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <variant>
#include <vector>

#include <Eigen/Core>

namespace touchfield {

/// One pattern in a device's own steps, in the device's order.
struct DriveFrame {
  std::vector<std::uint8_t> phase;      // N: step s of `phase_levels` is the phase 2 pi s / phase_levels [rad]
  std::vector<std::uint8_t> intensity;  // N: step t is the amplitude t / (intensity_levels - 1); 0 is off

  std::size_t size() const { return phase.size(); }
  bool operator==(const DriveFrame&) const = default;
};

/// How finely a device is driven.
struct DriveSteps {
  int phase_levels = 256;      // 2..256
  int intensity_levels = 256;  // 2..256; 2: on and off only
};

/// The frame in which n transducers are off: phase and intensity steps 0.
DriveFrame silent_frame(std::size_t n);

/// Phases [rad] of a frame's steps, 0 <= phase < 2 pi.
Eigen::VectorXd phases_of(const DriveFrame& frame, const DriveSteps& steps);

/// The largest amplitude in a frame, 0..1; 0 if it is silent.
double level_of(const DriveFrame& frame, const DriveSteps& steps);

/// What rounding to a device's steps did to one pattern or to several.
struct QuantisationReport {
  DriveSteps steps;
  std::size_t count = 0;         // transducers that are to be on, over all patterns
  double worst_phase_error = 0;  // [rad], at most pi / phase_levels
  double rms_phase_error = 0;    // [rad]; of evenly spread phases 2 pi / (phase_levels sqrt(12))
  double worst_drive_loss = 0;   // of any pattern, see quantise

  /// Takes in another pattern's report of the same steps.
  void add(const QuantisationReport& other);
};

struct QuantisedDrive {
  DriveFrame frame;
  QuantisationReport report;
};

/// Largest phase of a drive, up or down [rad]: its remainder of a turn is still known to 1e-10 rad. Phases that solvers
/// write lie in 0..2 pi.
inline constexpr double kMostPhase = 1e6;

/// Rounds drives w_n = level amplitude_n exp(i phase_n) to steps q_n.
///
///   phase      round(phase L / 2 pi) mod L: the last half step wraps to 0, it never becomes `off`
///   intensity  floor(level amplitude (Q - 1)): never louder than asked for
///   loss       1 - |sum_n conj(w_n) q_n|^2 / (sum |w_n|^2 sum |q_n|^2), the share of the radiated energy that goes
///              into another pattern where all transducers act alike; 0 if q is w times a number
///
/// phases       N [rad], -kMostPhase..kMostPhase
/// amplitudes   N, 0..1
/// level        0 < level <= 1
/// device       its name, for messages
/// throws       InputError on a value out of range, on sizes that differ, and, where a device is on or off only
///              (Q = 2), on an amplitude times level that is neither 0 nor 1
QuantisedDrive quantise(const Eigen::VectorXd& phases, const Eigen::VectorXd& amplitudes, double level,
                        const DriveSteps& steps, const std::string& device);

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
