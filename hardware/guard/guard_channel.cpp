#include <algorithm>
#include <cerrno>
#include <poll.h>
#include <sys/socket.h>

#include "hardware/guard/guard_message.h"
#include "sim/core/version.h"

namespace touchfield {

namespace {

constexpr std::uint32_t kMostBytes = 1U << 24;  // of a message; an array of a hundred thousand transducers has fewer
constexpr double kMessagePatience = 0.2;        // for the rest of a message that has begun [s]

/// Whether there is something to do with a socket within kPatienceStep.
bool ready(int descriptor, short what) {
  pollfd watched{descriptor, what, 0};
  return ::poll(&watched, 1, static_cast<int>(kPatienceStep * 1e3)) > 0;
}

}  // namespace

bool GuardChannel::send(const GuardMessage& message, double seconds) {
  const auto size = static_cast<std::uint32_t>(1 + message.with.size());
  const auto* length = reinterpret_cast<const std::uint8_t*>(&size);
  GuardBytes bytes(length, length + sizeof size);
  bytes.push_back(message.what);
  bytes.insert(bytes.end(), message.with.begin(), message.with.end());
  Patience patience(seconds, steady_now());
  for (std::size_t at = 0; at < bytes.size();) {
    const ssize_t sent = ::send(descriptor(), bytes.data() + at, bytes.size() - at, MSG_NOSIGNAL | MSG_DONTWAIT);
    if (sent < 0 && errno != EINTR && errno != EAGAIN) {
      return false;
    }
    at += static_cast<std::size_t>(std::max<ssize_t>(sent, 0));
    if (sent < 0 && !ready(descriptor(), POLLOUT) && patience.over(steady_now())) {
      return false;
    }
  }
  return true;
}

bool GuardChannel::waits() const { return ready(descriptor(), POLLIN); }

std::optional<GuardMessage> GuardChannel::receive() {
  std::uint32_t size = 0;
  if (!receive_bytes(reinterpret_cast<std::uint8_t*>(&size), sizeof size) || size < 1 || size > kMostBytes) {
    return std::nullopt;
  }
  GuardMessage message(GuardReply::kDone, GuardBytes(size - 1));
  const bool whole = receive_bytes(&message.what, 1) && receive_bytes(message.with.data(), message.with.size());
  return whole ? std::optional(std::move(message)) : std::nullopt;
}

bool GuardChannel::receive_bytes(std::uint8_t* data, std::size_t size) {
  Patience patience(kMessagePatience, steady_now());
  while (size > 0) {
    if (!waits()) {
      if (patience.over(steady_now())) {
        return false;
      }
      continue;
    }
    const ssize_t got = ::recv(descriptor(), data, size, 0);
    if (got == 0 || (got < 0 && errno != EINTR)) {
      return false;
    }
    data += std::max<ssize_t>(got, 0);
    size -= static_cast<std::size_t>(std::max<ssize_t>(got, 0));
  }
  return true;
}

}  // namespace touchfield
