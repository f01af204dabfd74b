#include "sim/cameras/joints_sensor.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <ctime>
#include <memory>
#include <netdb.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/core/require.h"
#include "sim/core/units.h"
#include "sim/core/version.h"
#include "sim/motion/loop_clock.h"

namespace touchfield {

JointsSensor::JointsSensor(const Scene& scene, const JointRecording& recording, const std::string& path,
                           KeptBodies* kept)
    : hand_(scene, kept), times_(recording.seconds), joints_(recording.joints), frames_(recording.joints.size()) {
  const std::vector<JointPoints> frames = first_second();
  require(!frames.empty(), "{}: no frame has a hand: each row lacks a joint, or has all of them in one place", path);
  notes_.push_back(hand_.learn(frames, path));
  fit_motion(scene.motion->seconds, scene.motion->sensor.hz, path);
}

/// The joints of the first second in which the tracker had a hand.
std::vector<JointPoints> JointsSensor::first_second() const {
  std::vector<JointPoints> frames;
  std::optional<double> begin;
  for (std::size_t k = 0; k < joints_.size(); ++k) {
    if (joints_[k] && times_.seconds(k) < begin.value_or(times_.seconds(k)) + JointsHand::kLearnt) {
      begin = begin.value_or(times_.seconds(k));
      frames.push_back(*joints_[k]);
    }
  }
  return frames;
}

/// All frames that are sampled, before the clock starts, so that a sample is a skin that is carried; and what is to be
/// said of them.
void JointsSensor::fit_motion(double seconds, double hz, const std::string& path) {
  double sum = 0;
  double worst = 0;
  std::size_t fitted_well = 0;
  std::array<std::size_t, 5> faults{};  // frames by their fault
  for (std::int64_t k = 0; k <= last_instant(to_ticks(seconds), hz); ++k) {
    const std::size_t newest = times_.newest(to_seconds(instant(k, hz)));
    std::optional<JointsHand::Frame>& frame = frames_[newest];
    if (frame) {
      continue;
    }
    frame = hand_.fitted(joints_[newest]);
    misplaced_.add(*frame, times_.seconds(newest));
    ++faults[static_cast<std::size_t>(frame->fault)];
    if (frame->fault != JointsHand::Fault::kNoHand) {
      sum += frame->off * frame->off;
      worst = std::max(worst, frame->off);
      ++fitted_well;
    }
  }
  misplaced_.require_some_placed(path);
  if (fitted_well > 0) {
    notes_.push_back(
        fmt::format("joints: the skeleton is {:.2f} mm rms off the tracked joints, {:.2f} mm in the worst frame",
                    std::sqrt(sum / static_cast<double>(fitted_well)) / kMillimetre, worst / kMillimetre));
  }
  const auto [good, empty, off, held, misplaced] = faults;
  if (empty + off + held > 0) {
    notes_.push_back(
        fmt::format("lost: of {} frames {} have no hand; {} are more than {:g} mm rms off every skeleton's pose; {} "
                    "move fingers that touch in the pose {}, which the fit keeps as they are. Choose a pose like "
                    "theirs for the fitted hand, or flat, in which all fingers turn",
                    fitted_well + empty, empty, off, JointsHand::kMostOff / kMillimetre, held, hand_.hand().pose));
  }
}

Seen JointsSensor::sample(std::int64_t /*number*/, double seconds) {
  const std::size_t frame = times_.newest(seconds);  // of those fitted, but `live` samples at other times as well
  return hand_.seen(times_.seconds(frame), frames_[frame] ? *frames_[frame] : hand_.fitted(joints_[frame]));
}

std::vector<TriangleMesh> JointsSensor::places(int count) const {
  std::vector<JointsHand::Frame> frames;
  for (const std::optional<JointsHand::Frame>& frame : frames_) {
    if (frame) {
      frames.push_back(*frame);
    }
  }
  return hand_.places(frames, count);
}

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

JointSocket::JointSocket(const ListenAddress& address, const RigidMotion& pose) : address_(address), pose_(pose) {
  addrinfo wanted{};
  wanted.ai_flags = AI_NUMERICHOST | AI_NUMERICSERV;
  wanted.ai_socktype = SOCK_DGRAM;
  addrinfo* own = nullptr;
  require(::getaddrinfo(address.host.c_str(), std::to_string(address.port).c_str(), &wanted, &own) == 0,
          "{} must be an IP address and port", name());
  const std::unique_ptr<addrinfo, decltype(&::freeaddrinfo)> owner(own, ::freeaddrinfo);
  socket_ = ::socket(own->ai_family, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  const int on = 1;
  if (socket_ < 0 || ::setsockopt(socket_, SOL_SOCKET, SO_TIMESTAMPNS, &on, sizeof on) != 0 ||
      ::bind(socket_, own->ai_addr, own->ai_addrlen) != 0) {
    const int failure = errno;
    if (socket_ >= 0) {
      ::close(socket_);
    }
    throw InputError(fmt::format("{} cannot be listened to: {}; {}", name(), std::strerror(failure),
                                 failure == EADDRNOTAVAIL
                                     ? "give an address of this machine, or 0.0.0.0 for all of them"
                                     : "choose another port"));
  }
}

JointSocket::~JointSocket() { ::close(socket_); }

std::string JointSocket::name() const { return fmt::format("UDP {} (motion.sensor.joints.listen)", address_.text()); }

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

LiveJointsSensor::LiveJointsSensor(const Scene& scene, const ListenAddress& address, const RigidMotion& pose,
                                   KeptBodies* kept, double patience)
    : hand_(scene, kept), socket_(address, pose), patience_(patience) {}

std::string LiveJointsSensor::silence_advice() const {
  std::string advice = "let the tracker's program send to this port of this machine while `touchfield live` waits";
  if (socket_.address().is_loopback()) {
    advice += fmt::format(
        ". Only programs of this machine reach {}: for a tracker elsewhere listen on the network, "
        "as \"0.0.0.0:{}\"",
        socket_.address().host, socket_.address().port);
  }
  return advice;
}

void LiveJointsSensor::start(Progress& progress) {
  constexpr double kLook = 0.1;  // [s] between looks at the clock
  progress.note(fmt::format("joints: waiting for a hand on {}", socket_.name()));
  std::vector<JointPoints> frames;
  int empty = 0;  // rows without a hand
  double end = steady_now() + patience_;
  while (steady_now() < end) {
    const auto received = socket_.next(kLook);
    empty += received && !received->joints ? 1 : 0;
    if (received && received->joints) {
      end = frames.empty() ? steady_now() + JointsHand::kLearnt : end;
      frames.push_back(*received->joints);
    }
  }
  if (frames.empty()) {
    throw InputError(fmt::format("{}: {} within {:g} s; {}", socket_.name(),
                                 empty > 0 ? fmt::format("{} rows came, none with a hand,", empty) : "nothing came",
                                 patience_, empty > 0 ? "hold the hand where the tracker sees it" : silence_advice()));
  }
  notes_ = {hand_.learn(frames, socket_.name())};
  learnt_.clear();
  MisplacedHands misplaced;
  for (const JointPoints& joints : frames) {
    learnt_.push_back(hand_.fitted(joints));
    misplaced.add(learnt_.back(), 0);
  }
  misplaced.require_some_placed(socket_.name());
  misplaced_ = {};
}

std::vector<std::string> LiveJointsSensor::warnings() const {
  std::vector<std::string> warnings = misplaced_.warnings();
  if (!socket_.address().is_loopback()) {
    warnings.insert(warnings.begin(),
                    fmt::format("open_port: whoever reaches UDP {} over the network can move the sound, and nobody is "
                                "asked who it is: let a firewall pass the tracker alone",
                                socket_.address().text()));
  }
  return warnings;
}

Seen LiveJointsSensor::sample(std::int64_t /*number*/, double seconds) {
  const auto received = socket_.newest();
  if (!received || received->age > kSilence) {
    return hand_.seen(seconds, {});
  }
  const JointsHand::Frame frame = hand_.fitted(received->joints);
  misplaced_.add(frame, seconds);
  return hand_.seen(seconds - received->age, frame);
}

}  // namespace touchfield
