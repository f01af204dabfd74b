#pragma once

#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "hardware/array_link.h"
#include "hardware/attention.h"
#include "hardware/links/make_link.h"
#include "sim/core/child_process.h"

namespace touchfield {

/// What a program asks its guard for, and what goes with it. Every request is answered.
enum class GuardRequest : std::uint8_t {
  kStart,       // GuardStart
  kOpen,        //
  kModulation,  // Modulation
  kSend,        // DriveFrame
  kStore,       // StoredFrames
  kPlayStored,  // StoredPlay
  kCheck,       // also the program's sign of life
  kSilence,     //
  kClose,       // and end; the answer has the Gaps of the guard while the device could emit
};

/// The answer; with an error goes a text.
enum class GuardReply : std::uint8_t {
  kDone,
  kInputError,
  kDeviceError,
  kError,
  kStopped,  // the guard silenced the device of its own accord and ends; may come unasked
  kAlive,    // the answer takes longer
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

struct StoredFrames {
  std::size_t first = 0;
  std::vector<DriveFrame> frames;
};

struct StoredPlay {
  std::size_t count = 0;
  double rate = 0;
};

using GuardBytes = std::vector<std::uint8_t>;

struct GuardMessage {
  template <class What>
  explicit GuardMessage(What message, GuardBytes bytes = {})
      : what(static_cast<std::uint8_t>(message)), with(std::move(bytes)) {}

  std::uint8_t what;  // a GuardRequest or GuardReply
  GuardBytes with;    // packed
};

/// A value as it goes with a message: of the types named above, or a text.
template <class Value>
GuardBytes packed(const Value& value);
/// throws   IoError on bytes that are no such value
template <class Value>
Value unpacked(const GuardBytes& bytes);

/// One end of the socket between a program and its guard: whole messages, each with its length before it.
class GuardChannel {
 public:
  explicit GuardChannel(Descriptor descriptor = Descriptor()) : descriptor_(std::move(descriptor)) {}

  int descriptor() const { return descriptor_.number(); }
  /// seconds    for the other end to take it
  /// returns    false if it did not, or is gone
  bool send(const GuardMessage& message, double seconds);
  /// Waits for a message, or the end of the other one, for at most kPatienceStep.
  bool waits() const;
  /// returns   nothing if the other end is gone, or sends no whole message: who does that is as good as gone
  std::optional<GuardMessage> receive();
  void close() { descriptor_.close(); }

 private:
  bool receive_bytes(std::uint8_t* data, std::size_t size);

  Descriptor descriptor_;
};

}  // namespace touchfield
