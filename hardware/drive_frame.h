#pragma once

#include <cstdint>
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

}  // namespace touchfield
