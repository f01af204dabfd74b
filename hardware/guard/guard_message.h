#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "hardware/array_link.h"
#include "hardware/attention.h"
#include "hardware/links/make_link.h"

namespace touchfield {

/// What a link's owner asks its guard for, and what goes with it -> with the answer. Every request is answered.
enum class GuardRequest : std::uint8_t {
  kStart,       // GuardStart -> GuardedDevice
  kOpen,        //
  kModulation,  // Modulation
  kSend,        // DriveFrame
  kStore,       // StoredFrames
  kPlayStored,  // StoredPlay
  kCheck,       //
  kQuiet,       //
  kClose,       // and end -> Gaps, of the guard while the device could emit
};

/// The answer; with anything but kDone goes a text.
enum class GuardReply : std::uint8_t {
  kDone,
  kInputError,
  kDeviceError,
  kError,
  kStopped,  // the guard quieted the device of its own accord and ends; may come unasked
};

/// What a guard tells its watchdog.
enum class GuardNote : std::uint8_t {
  kDevice,  // LinkSettings
  kOn,      // from now on the device may emit
  kOff,     // it is quiet, or given up
};

/// What a guard lets through.
struct GuardLimits {
  double level = 0.5;   // largest amplitude, 0..1
  double seconds = 10;  // of emission from the first frame on
};

struct GuardStart {
  GuardLimits limits;
  LinkSettings settings;
};

struct GuardedDevice {
  std::string description;
  LinkAbilities abilities;
  ArrayLayout layout;
  int guard = 0;  // its process
};

struct StoredFrames {
  std::size_t first = 0;
  std::vector<DriveFrame> frames;
};

struct StoredPlay {
  std::size_t count = 0;
  double rate = 0;
};

using GuardBytes = std::vector<std::uint8_t>;

/// What these processes, all of one program, say to each other.
struct GuardMessage {
  template <class What>
  explicit GuardMessage(What message, GuardBytes bytes = {})
      : what(static_cast<std::uint8_t>(message)), with(std::move(bytes)) {}

  std::uint8_t what;  // a GuardRequest, GuardReply or GuardNote
  GuardBytes with;    // packed
};

/// A value as it goes with a message: of the types named above, or a text.
template <class Value>
GuardBytes packed(const Value& value);
/// throws   IoError on bytes that are no such value
template <class Value>
Value unpacked(const GuardBytes& bytes);

}  // namespace touchfield
