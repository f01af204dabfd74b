#pragma once

#include <cstdint>
#include <vector>

#include <nlohmann/json.hpp>

#include "hardware/array_link.h"
#include "hardware/make_link.h"

namespace touchfield {

/// What a link's owner asks its guard for: {"request": this, "with": what it needs}. Every request is answered.
enum class GuardRequest {
  kStart,               // {"limits": GuardLimits, "settings": LinkSettings} -> {"description", "abilities", "layout"}
  kOpen,                //
  kModulation,          // Modulation
  kSend,                // DriveFrame
  kCheck,               //
  kReadBack,            // -> DriveFrame, or null if there is none
  kReadBackModulation,  // -> bytes, or null if there are none
  kQuiet,               //
  kClose,               // and end
};

/// The answer: {"reply": this, "with": what was asked for, or a text}.
enum class GuardReply {
  kDone,
  kInputError,
  kDeviceError,
  kError,
  kStopped,  // the guard quieted the device of its own accord and ends; may come unasked
};

/// What a guard tells its watchdog: {"note": this, "with": LinkSettings of kDevice}.
enum class GuardNote {
  kDevice,
  kOn,   // from now on the device may emit
  kOff,  // it is quiet, or given up
};

/// What a guard lets through.
struct GuardLimits {
  double level = 0.5;   // largest amplitude, 0..1
  double seconds = 10;  // of emission from the first frame on
};

/// What these processes, all of one program, say to each other; null is a sign of life.
using GuardMessage = nlohmann::json;

/// A message as MessagePack; null has no bytes.
std::vector<std::uint8_t> packed(const GuardMessage& message);
/// throws   IoError on bytes that are no message
GuardMessage unpacked(const std::vector<std::uint8_t>& bytes);

NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(GuardLimits, level, seconds)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(DriveFrame, phase, intensity)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(DriveSteps, phase_levels, intensity_levels)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(ModulationAbility, rate, most_samples, own_frequencies)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(LinkAbilities, steps, most_frames_per_second, modulation, reads_back)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(SineModulation, frequency, depth)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(SampledModulation, samples, rate)
void to_json(GuardMessage& message, const Modulation& modulation);
void from_json(const GuardMessage& message, Modulation& modulation);
void to_json(GuardMessage& message, const ArrayLayout& layout);
void from_json(const GuardMessage& message, ArrayLayout& layout);
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(LinkSettings, address, library, array, frames, replace)

}  // namespace touchfield
