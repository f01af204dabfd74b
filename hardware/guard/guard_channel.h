#pragma once

#include <optional>
#include <sys/types.h>

#include "hardware/attention.h"
#include "hardware/guard/guard_message.h"
#include "sim/core/child_process.h"

namespace touchfield {

/// What a message says that says nothing.
inline constexpr std::uint8_t kSignOfLife = 255;

/// For the rest of a message that has begun [s].
inline constexpr double kMessagePatience = 0.05;

/// One end of the socket between a link's owner and its guard: whole messages, each with its length before it.
class GuardChannel {
 public:
  /// Takes over a descriptor.
  explicit GuardChannel(Descriptor descriptor = Descriptor()) : descriptor_(std::move(descriptor)) {}

  int descriptor() const { return descriptor_.number(); }
  /// The process that made the pair of sockets.
  /// throws   IoError if it is not one
  pid_t maker() const;
  /// returns  false if the other end is gone
  bool send(const GuardMessage& message);
  /// Sends a sign of life, unless the other end has so many unread that it would have to wait.
  void beat();
  /// Waits for a message, or the end of the other one.
  /// returns    whether it came within so many seconds
  bool waits(double seconds) const;
  /// seconds    for the whole message
  /// returns    nothing if the other end is gone
  /// throws     IoError if the message does not come, or is not one
  std::optional<GuardMessage> receive(double seconds);
  void close() { descriptor_.close(); }

 private:
  bool readable(Patience& patience) const;
  bool receive_bytes(std::uint8_t* data, std::size_t size, Patience& patience);

  Descriptor descriptor_;
};

}  // namespace touchfield
