#include "hardware/guard/guard_channel.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <poll.h>
#include <sys/socket.h>

#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/core/steady_now.h"

namespace touchfield {

namespace {

constexpr std::uint32_t kMostBytes = 1U << 24;  // of a message; an array of a hundred thousand transducers has fewer

}  // namespace

bool GuardChannel::send(const GuardMessage& message) {
  const auto size = static_cast<std::uint32_t>(1 + message.with.size());
  const auto* length = reinterpret_cast<const std::uint8_t*>(&size);
  GuardBytes bytes(length, length + sizeof size);
  bytes.push_back(message.what);
  bytes.insert(bytes.end(), message.with.begin(), message.with.end());
  for (std::size_t at = 0; at < bytes.size();) {
    const ssize_t sent = ::send(descriptor(), bytes.data() + at, bytes.size() - at, MSG_NOSIGNAL);
    if (sent < 0 && errno != EINTR) {
      return false;
    }
    at += static_cast<std::size_t>(std::max<ssize_t>(sent, 0));
  }
  return true;
}

pid_t GuardChannel::maker() const {
  ucred credentials{};
  socklen_t size = sizeof credentials;
  if (::getsockopt(descriptor(), SOL_SOCKET, SO_PEERCRED, &credentials, &size) != 0) {
    throw IoError(fmt::format("link guard: the owner of the channel cannot be determined: {}", std::strerror(errno)));
  }
  return credentials.pid;
}

void GuardChannel::beat() {
  constexpr std::uint32_t kEmpty = 0;
  ::send(descriptor(), &kEmpty, sizeof kEmpty, MSG_NOSIGNAL | MSG_DONTWAIT);
}

bool GuardChannel::waits(double seconds) const {
  Patience patience(seconds, steady_now());
  return readable(patience);
}

std::optional<GuardMessage> GuardChannel::receive(double seconds) {
  Patience patience(seconds, steady_now());
  std::uint32_t size = 0;
  if (!receive_bytes(reinterpret_cast<std::uint8_t*>(&size), sizeof size, patience)) {
    return std::nullopt;
  }
  if (size > kMostBytes) {
    throw IoError("link guard: malformed message");
  }
  GuardMessage message(kSignOfLife, GuardBytes(std::max(1U, size) - 1));
  if ((size > 0 && !receive_bytes(&message.what, 1, patience)) ||
      !receive_bytes(message.with.data(), message.with.size(), patience)) {
    return std::nullopt;
  }
  return message;
}

bool GuardChannel::readable(Patience& patience) const {
  pollfd watched{descriptor(), POLLIN, 0};
  while (::poll(&watched, 1, static_cast<int>(kPatienceStep * 1e3)) <= 0) {
    if (patience.over(steady_now())) {
      return false;
    }
  }
  return true;
}

bool GuardChannel::receive_bytes(std::uint8_t* data, std::size_t size, Patience& patience) {
  while (size > 0) {
    if (!readable(patience)) {
      throw IoError("link guard: no answer");
    }
    const ssize_t got = ::recv(descriptor(), data, size, 0);
    if (got < 0 && errno == EINTR) {
      continue;
    }
    if (got <= 0) {
      return false;
    }
    data += got;
    size -= static_cast<std::size_t>(got);
  }
  return true;
}

}  // namespace touchfield
