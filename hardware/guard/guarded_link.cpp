#include "hardware/guard/guarded_link.h"

#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <thread>
#include <unistd.h>
#include <utility>

#include <fmt/format.h>

#include "hardware/guard/guard_process.h"
#include "hardware/stop_signals.h"
#include "sim/core/errors.h"
#include "sim/core/version.h"

namespace touchfield {

namespace {

constexpr double kOpenPatience = 30;  // where a network is connected, or a silent device made ready [s]
constexpr double kEndPatience = 1;    // for the end of a guard [s]

/// Starts a program in a session of its own, where no signal of a terminal reaches it. Of what is open here it has but
/// standard error and the socket: a reader of this program's output does not wait for it.
///
/// throws   IoError if it cannot be started
pid_t start_apart(const std::vector<std::string>& command, const Descriptor& socket) {
  std::vector<char*> arguments;
  for (const std::string& word : command) {
    arguments.push_back(const_cast<char*>(word.c_str()));
  }
  arguments.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
  posix_spawn_file_actions_adddup2(&actions, socket.number(), kGuardDescriptor);
  posix_spawn_file_actions_addclosefrom_np(&actions, kGuardDescriptor + 1);
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSID);
  pid_t started = -1;
  const int error = ::posix_spawn(&started, command.front().c_str(), &actions, &attributes, arguments.data(), environ);
  posix_spawnattr_destroy(&attributes);
  posix_spawn_file_actions_destroy(&actions);
  if (error != 0) {
    throw IoError(fmt::format("link guard: {} cannot be started: {}", command.front(), std::strerror(error)));
  }
  return started;
}

bool is_stopped(pid_t child) {
  siginfo_t info{};
  return ::waitid(P_PID, static_cast<id_t>(child), &info, WSTOPPED | WNOHANG | WNOWAIT) == 0 && info.si_pid == child;
}

}  // namespace

GuardedLink::GuardedLink(const std::vector<std::string>& command, const LinkSettings& settings,
                         const GuardLimits& limits)
    : own_(make_link(settings)) {
  SocketPair ends;
  channel_ = GuardChannel(std::move(ends.own));
  guard_ = start_apart(command, ends.others);
  ends.others.close();
  try {
    ask(GuardRequest::kStart, packed(GuardStart{limits, settings}), kOpenPatience);
  } catch (...) {
    close();
    throw;
  }
}

GuardedLink::~GuardedLink() { close(); }

void GuardedLink::open() { ask(GuardRequest::kOpen, {}, kOpenPatience); }

void GuardedLink::set_modulation(const Modulation& modulation) {
  ask(GuardRequest::kModulation, packed(modulation), kOpenPatience);
}

void GuardedLink::send(const DriveFrame& frame) {
  on_ = true;
  ask(GuardRequest::kSend, packed(frame));
}

void GuardedLink::store(std::size_t first, const std::vector<DriveFrame>& frames) {
  ask(GuardRequest::kStore, packed(StoredFrames{first, frames}));
}

void GuardedLink::play_stored(std::size_t count, double rate) {
  on_ = true;
  ask(GuardRequest::kPlayStored, packed(StoredPlay{count, rate}));
}

void GuardedLink::check() { ask(GuardRequest::kCheck); }

void GuardedLink::silence() { ask(GuardRequest::kSilence); }

void GuardedLink::close() noexcept {
  if (guard_ < 0) {
    return;
  }
  const bool on = on_;
  try {
    gaps_ = unpacked<Gaps>(ask(GuardRequest::kClose));
  } catch (const std::exception& error) {
    if (on && !has_told_) {
      std::fputs(fmt::format("touchfield: {}\n", error.what()).c_str(), stderr);
    }
  }
  channel_.close();
  if (guard_ >= 0) {
    end_of_guard(kEndPatience);
    guard_ = -1;
  }
}

GuardBytes GuardedLink::ask(GuardRequest request, GuardBytes with, double patience) {
  if (guard_ < 0) {
    throw DeviceError("link guard: it is gone");
  }
  // A guard that stopped of its own accord has left the reason in the channel.
  const bool taken = channel_.send(GuardMessage(request, std::move(with)), patience);
  Patience waiting(taken ? patience : 0.0, steady_now());
  for (;;) {
    if (channel_.waits()) {
      std::optional<GuardMessage> answer = channel_.receive();
      if (!answer) {
        lose("");
      }
      if (static_cast<GuardReply>(answer->what) != GuardReply::kAlive) {
        return result_of(std::move(*answer), request);
      }
      waiting = Patience(patience, steady_now());
    } else if (is_stopped(guard_)) {
      lose("was stopped by a signal");
    } else if (waiting.over(steady_now())) {
      lose(fmt::format("did not answer for {:g} s", patience));
    }
  }
}

GuardBytes GuardedLink::result_of(GuardMessage answer, GuardRequest request) {
  const auto reply = static_cast<GuardReply>(answer.what);
  // After an error the guard has silenced the device, and says how that went.
  on_ = on_ && (reply == GuardReply::kInputError ||
                (reply == GuardReply::kDone && request != GuardRequest::kSilence && request != GuardRequest::kClose));
  has_told_ = has_told_ || reply == GuardReply::kStopped;
  switch (reply) {
    case GuardReply::kDone:
      return std::move(answer.with);
    case GuardReply::kInputError:
      throw InputError(unpacked<std::string>(answer.with));
    case GuardReply::kDeviceError:
    case GuardReply::kStopped:
      throw DeviceError(unpacked<std::string>(answer.with));
    default:
      throw IoError(unpacked<std::string>(answer.with));
  }
}

void GuardedLink::lose(std::string fault) {
  channel_.close();
  if (!fault.empty()) {
    ::kill(guard_, SIGKILL);
  }
  const std::optional<int> status = end_of_guard(kEndPatience);
  if (fault.empty()) {
    fault = status && WIFSIGNALED(*status) ? "was ended by " + StopSignals::name(WTERMSIG(*status)) : "is gone";
  }
  const bool on = std::exchange(on_, false);
  guard_ = -1;
  std::string left;
  if (!status && on) {
    left = std::string(" and cannot be ended") + kMayBeOn;
  } else if (on) {
    try {
      own_->take_over();
      left = "; " + silenced(*own_).text;
    } catch (const std::exception& error) {
      left = fmt::format("; the array could not be silenced: {}{}", error.what(), kMayBeOn);
    }
  }
  if (left.ends_with(kMayBeOn)) {  // at once: closing a stalled line may take its time
    std::fputs(fmt::format("touchfield: link guard: it {}{}\n", fault, left).c_str(), stderr);
  }
  throw DeviceError(fmt::format("link guard: it {}{}", fault, left));
}

std::optional<int> GuardedLink::end_of_guard(double seconds) {
  int status = 0;
  Patience patience(seconds, steady_now());
  while (::waitpid(guard_, &status, WNOHANG) == 0) {
    if (patience.over(steady_now())) {
      return std::nullopt;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  guard_ = -1;
  return status;
}

}  // namespace touchfield
