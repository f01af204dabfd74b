#pragma once

#include <optional>
#include <sys/types.h>

#include "hardware/guard/guard_message.h"

namespace touchfield {

/// For the rest of a message that has begun [s].
inline constexpr double kMessagePatience = 0.05;

/// One end of the socket between a link's owner and its guard: whole messages, each with its length before it.
class GuardChannel {
 public:
  /// Takes over a descriptor.
  explicit GuardChannel(int descriptor) : descriptor_(descriptor) {}
  ~GuardChannel() { close(); }
  GuardChannel(const GuardChannel&) = delete;
  GuardChannel& operator=(const GuardChannel&) = delete;

  /// Takes over another descriptor.
  void adopt(int descriptor);
  int descriptor() const { return descriptor_; }
  /// The process that made the pair of sockets.
  /// throws   IoError if it is none
  pid_t maker() const;
  /// returns  false if the other end is gone
  bool send(const GuardMessage& message);
  /// Sends an empty message, a sign of life, unless the other end has so many unread that it would have to wait.
  void beat();
  /// patience   for the whole message [s]
  /// returns    nothing if the other end is gone; a message without bytes is a sign of life
  /// throws     IoError if the message does not come, or is none
  std::optional<GuardMessage> receive(double patience);
  void close();

 private:
  bool receive_bytes(std::uint8_t* data, std::size_t size, double until);

  int descriptor_;
};

}  // namespace touchfield
