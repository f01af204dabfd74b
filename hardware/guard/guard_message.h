#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "hardware/array_link.h"
#include "hardware/make_link.h"

namespace touchfield {

/// What a link's owner asks its guard for; every request is answered by one Reply.
enum class GuardRequest : std::uint32_t {
  kStart,               // GuardLimits, LinkSettings -> description, abilities, layout
  kOpen,                //
  kModulation,          // Modulation
  kSend,                // DriveFrame
  kCheck,               //
  kReadBack,            // -> whether there is one, DriveFrame
  kReadBackModulation,  // -> whether there is one, bytes
  kQuiet,               //
  kClose,               // and end
};

enum class GuardReply : std::uint32_t {
  kDone,         // and what was asked for
  kInputError,   // text
  kDeviceError,  // text
  kError,        // text
  kStopped,      // text; the guard quieted the device of its own accord and ends; may come unasked
};

/// What a guard tells its watchdog; a message without bytes is a sign of life.
enum class GuardNote : std::uint32_t {
  kDevice,  // LinkSettings
  kOn,      // from now on the device may emit
  kOff,     // it is quiet, or given up
};

/// What a guard lets through.
struct GuardLimits {
  double level = 0.5;   // largest amplitude, 0..1
  double seconds = 10;  // of emission from the first frame on
};

/// Values one behind the other, as both ends of one program write and read them.
class GuardMessage {
 public:
  GuardMessage() = default;
  explicit GuardMessage(std::vector<std::uint8_t> bytes) : bytes_(std::move(bytes)) {}

  const std::vector<std::uint8_t>& bytes() const { return bytes_; }

  GuardMessage& put(std::uint32_t value);
  GuardMessage& put(double value);
  GuardMessage& put(const std::string& text);
  GuardMessage& put(const std::vector<std::uint8_t>& data);
  GuardMessage& put(const DriveFrame& frame);
  GuardMessage& put(const Modulation& modulation);
  GuardMessage& put(const ArrayLayout& layout);
  GuardMessage& put(const LinkAbilities& abilities);
  GuardMessage& put(const LinkSettings& settings);
  GuardMessage& append(const GuardMessage& other);
  GuardMessage& put(GuardRequest request) { return put(static_cast<std::uint32_t>(request)); }
  GuardMessage& put(GuardReply reply) { return put(static_cast<std::uint32_t>(reply)); }
  GuardMessage& put(GuardNote note) { return put(static_cast<std::uint32_t>(note)); }

  /// The next value; throws IoError where the message ends before it.
  std::uint32_t take_number();
  double take_real();
  std::string take_text();
  std::vector<std::uint8_t> take_data();
  DriveFrame take_frame();
  Modulation take_modulation();
  ArrayLayout take_layout();
  LinkAbilities take_abilities();
  LinkSettings take_settings();

 private:
  void put_raw(const void* data, std::size_t size);
  void take_raw(void* data, std::size_t size);

  std::vector<std::uint8_t> bytes_;
  std::size_t at_ = 0;
};

}  // namespace touchfield
