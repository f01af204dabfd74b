#include "sim/cameras/joint_socket.h"

#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <ctime>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <fmt/format.h>

#include "sim/core/errors.h"

namespace touchfield {

namespace {

constexpr std::size_t kLargest = 65'536;  // datagram [bytes]

double seconds_of(const timespec& time) {
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

/// Of the clock that the system stamps datagrams by.
double arrival_now() {
  timespec now{};
  ::clock_gettime(CLOCK_REALTIME, &now);
  return seconds_of(now);
}

struct Datagram {
  std::string text;
  double came;  // [s]
};

/// The oldest that waits, if one does.
std::optional<Datagram> taken(int socket) {
  Datagram datagram{std::string(kLargest, ' '), arrival_now()};
  iovec part{datagram.text.data(), datagram.text.size()};
  alignas(cmsghdr) std::array<char, 256> control{};
  msghdr message{};
  message.msg_iov = &part;
  message.msg_iovlen = 1;
  message.msg_control = control.data();
  message.msg_controllen = control.size();
  ssize_t size = -1;
  do {
    size = ::recvmsg(socket, &message, MSG_DONTWAIT);
  } while (size < 0 && errno == EINTR);
  if (size < 0) {
    if (errno == EAGAIN || errno == EWOULDBLOCK) {
      return {};
    }
    throw IoError(fmt::format("tracked joints cannot be received: {}", std::strerror(errno)));
  }
  datagram.text.resize(static_cast<std::size_t>(size));
  for (cmsghdr* item = CMSG_FIRSTHDR(&message); item != nullptr; item = CMSG_NXTHDR(&message, item)) {
    if (item->cmsg_level == SOL_SOCKET && item->cmsg_type == SO_TIMESTAMPNS) {
      timespec stamp{};
      std::memcpy(&stamp, CMSG_DATA(item), sizeof stamp);
      datagram.came = seconds_of(stamp);
    }
  }
  return datagram;
}

}  // namespace

JointSocket::JointSocket(int port, const RigidMotion& pose) : port_(port), pose_(pose) {
  socket_ = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  sockaddr_in own{};
  own.sin_family = AF_INET;
  own.sin_port = htons(static_cast<std::uint16_t>(port));
  own.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  const int on = 1;
  if (socket_ < 0 || ::setsockopt(socket_, SOL_SOCKET, SO_TIMESTAMPNS, &on, sizeof on) != 0 ||
      ::bind(socket_, reinterpret_cast<const sockaddr*>(&own), sizeof own) != 0) {
    const std::string why = std::strerror(errno);
    if (socket_ >= 0) {
      ::close(socket_);
    }
    throw InputError(fmt::format("{} cannot be listened to: {}; choose another port", name(), why));
  }
}

JointSocket::~JointSocket() { ::close(socket_); }

std::string JointSocket::name() const { return fmt::format("UDP port {} (motion.sensor.joints.port)", port_); }

std::optional<JointSocket::Received> JointSocket::next(double patience) {
  pollfd ready{socket_, POLLIN, 0};
  if (::poll(&ready, 1, static_cast<int>(std::ceil(1e3 * patience))) <= 0) {
    return {};
  }
  const std::optional<Datagram> datagram = taken(socket_);
  if (!datagram) {
    return {};
  }
  came_ = datagram->came;
  try {
    joints_ = joints_of_row(datagram->text, pose_);
  } catch (const InputError& error) {
    throw InputError(fmt::format("{}: a datagram is not a row of joints: {}", name(), error.what()));
  }
  return Received{joints_, arrival_now() - *came_};
}

std::optional<JointSocket::Received> JointSocket::newest() {
  while (true) {
    try {
      if (!next(0)) {
        break;
      }
    } catch (const InputError&) {
      joints_.reset();
    }
  }
  return came_ ? std::optional(Received{joints_, arrival_now() - *came_}) : std::nullopt;
}

}  // namespace touchfield
