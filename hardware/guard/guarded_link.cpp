#include "hardware/guard/guarded_link.h"

#include <cerrno>
#include <chrono>
#include <cstring>
#include <fcntl.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <thread>
#include <unistd.h>

#include <fmt/format.h>

#include "sim/core/errors.h"

namespace touchfield {

namespace {

constexpr double kPatience = 2;       // for an answer [s]; the link itself gives up after kLinkPatience
constexpr double kOpenPatience = 30;  // where a library is loaded or a network connected [s]

// Both ends are closed in every program that is started, but for the one that the guard is handed.
struct SocketPair {
  SocketPair() {
    int ends[2] = {-1, -1};
    if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0) {
      throw IoError(fmt::format("link guard: no channel: {}", std::strerror(errno)));
    }
    own = ends[0];
    guards = ends[1];
  }
  int own;
  int guards;
};

pid_t started(const std::vector<std::string>& command, int descriptor) {
  std::vector<char*> arguments;
  arguments.reserve(command.size() + 1);
  for (const std::string& word : command) {
    arguments.push_back(const_cast<char*>(word.c_str()));
  }
  arguments.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, descriptor, kGuardDescriptor);
  pid_t guard = -1;
  const int error = ::posix_spawn(&guard, command.front().c_str(), &actions, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  ::close(descriptor);
  if (error != 0) {
    throw IoError(fmt::format("link guard: {} cannot be started: {}", command.front(), std::strerror(error)));
  }
  return guard;
}

}  // namespace

GuardedLink::GuardedLink(const std::vector<std::string>& command, const LinkSettings& settings,
                         const GuardLimits& limits)
    : channel_(-1) {
  const SocketPair ends;
  channel_.adopt(ends.own);
  guard_ = started(command, ends.guards);
  try {
    GuardMessage answer = ask(
        GuardMessage().put(GuardRequest::kStart).put(limits.level).put(limits.seconds).put(settings), kOpenPatience);
    description_ = answer.take_text();
    abilities_ = answer.take_abilities();
    layout_ = answer.take_layout();
  } catch (...) {
    close();
    throw;
  }
}

GuardedLink::~GuardedLink() { close(); }

void GuardedLink::open() { ask(GuardMessage().put(GuardRequest::kOpen), kOpenPatience); }

void GuardedLink::set_modulation(const Modulation& modulation) {
  ask(GuardMessage().put(GuardRequest::kModulation).put(modulation), kPatience);
}

void GuardedLink::send(const DriveFrame& frame) { ask(GuardMessage().put(GuardRequest::kSend).put(frame), kPatience); }

void GuardedLink::check() { ask(GuardRequest::kCheck); }

std::optional<DriveFrame> GuardedLink::read_back() {
  GuardMessage answer = ask(GuardRequest::kReadBack);
  return answer.take_number() != 0 ? std::optional(answer.take_frame()) : std::nullopt;
}

std::optional<std::vector<std::uint8_t>> GuardedLink::read_back_modulation() {
  GuardMessage answer = ask(GuardRequest::kReadBackModulation);
  return answer.take_number() != 0 ? std::optional(answer.take_data()) : std::nullopt;
}

void GuardedLink::quiet() { ask(GuardRequest::kQuiet); }

void GuardedLink::close() noexcept {
  if (guard_ < 0) {
    return;
  }
  try {
    ask(GuardRequest::kClose);
  } catch (const std::exception&) {  // it stopped before, or does not answer: its end of the channel tells it
  }
  channel_.close();
  const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(kPatience);
  while (::waitpid(guard_, nullptr, WNOHANG) == 0 && std::chrono::steady_clock::now() < end) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  guard_ = -1;
}

GuardMessage GuardedLink::ask(GuardRequest request) { return ask(GuardMessage().put(request), kPatience); }

GuardMessage GuardedLink::ask(const GuardMessage& request, double patience) {
  // A guard that stopped of its own accord has left the reason in the channel.
  channel_.send(request);
  std::optional<GuardMessage> answer;
  try {
    answer = channel_.receive(patience);
  } catch (const IoError& error) {
    throw DeviceError(fmt::format("{}; the array may still be on: switch off its supply", error.what()));
  }
  if (!answer) {
    throw DeviceError("link guard: it is gone; the array may still be on: switch off its supply");
  }
  const auto reply = static_cast<GuardReply>(answer->take_number());
  switch (reply) {
    case GuardReply::kDone:
      return std::move(*answer);
    case GuardReply::kInputError:
      throw InputError(answer->take_text());
    case GuardReply::kDeviceError:
    case GuardReply::kStopped:
      throw DeviceError(answer->take_text());
    case GuardReply::kError:
      break;
  }
  throw IoError(answer->take_text());
}

}  // namespace touchfield
