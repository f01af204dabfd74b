#pragma once

#include <string>

#include "hardware/drive_frame.h"

namespace touchfield {

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

}  // namespace touchfield
