#include "hardware/device_lock.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <sys/socket.h>
#include <sys/un.h>

#include <fmt/format.h>

#include "sim/core/errors.h"

namespace touchfield {

DeviceLock::DeviceLock(const std::string& key, const std::string& device)
    : socket_(::socket(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0)) {
  const std::string name = std::string(1, '\0') + "touchfield " + key;  // the 0: a name without a file
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  name.copy(address.sun_path, sizeof address.sun_path);
  const auto length =
      static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + std::min(name.size(), sizeof address.sun_path));
  const auto* at = reinterpret_cast<const sockaddr*>(&address);
  if (::bind(socket_.number(), at, length) == 0 && ::listen(socket_.number(), SOMAXCONN) == 0) {
    return;
  }
  if (errno != EADDRINUSE) {
    throw DeviceError(fmt::format("{}: cannot be kept from other programs: {}", device, std::strerror(errno)));
  }
  // The system tells who listens, unless that process is in a container.
  ucred holder{};
  socklen_t size = sizeof holder;
  const bool known = ::connect(socket_.number(), at, length) == 0 &&
                     ::getsockopt(socket_.number(), SOL_SOCKET, SO_PEERCRED, &holder, &size) == 0 && holder.pid > 0;
  throw DeviceError(known ? fmt::format("{}: busy: process {} drives it; `kill {}` silences and frees it", device,
                                        holder.pid, holder.pid)
                          : fmt::format("{}: busy: another program of this machine drives it", device));
}

}  // namespace touchfield
