#pragma once

#include <cstddef>
#include <optional>
#include <string>

#include "hardware/array_link.h"

namespace touchfield {

/// How hard, long and fast an array is asked to be driven, and the caps on that. Messages name the fields as the command
/// line does.
struct EmissionRequest {
  std::optional<double> level;    // --level: 0 < level <= 1; default kUsualLevel, or 1 where a device has no other
  double most_level = 0.5;        // --max-level: cap, 0 < most_level <= 1
  std::optional<double> seconds;  // --seconds: default kOneFrameSeconds for one frame, else once through
  double most_seconds = 10;       // --max-seconds: cap, > 0 [s]
  double rate = 1;                // [frames/s]
  bool repeat = false;            // begin a sequence again after its last frame
};

inline constexpr double kUsualLevel = 0.5;
inline constexpr double kOneFrameSeconds = 1;  // [s]

/// The level that may be emitted: what is asked for, else min(kUsualLevel, most_level), else 1 where a device drives its
/// transducers fully or not at all.
///
/// device   its name, for messages
/// throws   InputError: a level or cap out of range, above the cap, or that the device does not have
double permitted_level(const EmissionRequest& request, const LinkAbilities& abilities, const std::string& device);

/// The time that may be emitted [s]: what is asked for, else kOneFrameSeconds for one frame and frames / rate for more.
///
/// frames   at least 1
/// throws   InputError: a time or cap that is not positive and finite, or above the cap
double permitted_seconds(const EmissionRequest& request, std::size_t frames);

/// The rate of frames [1/s].
///
/// throws   InputError if it is not positive or more than the device carries
double permitted_rate(const EmissionRequest& request, const LinkAbilities& abilities, const std::string& device);

/// Asks a device for the pattern it emits, and refuses one that is not what was sent. A device that cannot say passes.
///
/// throws   DeviceError naming the first transducer that differs
void require_read_back(const DriveFrame& sent, ArrayLink& link);

/// The same of its modulation buffer, which may hold the samples several times over.
///
/// throws   DeviceError
void require_read_back(const Modulation& sent, ArrayLink& link);

}  // namespace touchfield
