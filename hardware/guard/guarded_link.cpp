#include "hardware/guard/guarded_link.h"

#include <chrono>
#include <optional>
#include <sys/wait.h>
#include <thread>
#include <unistd.h>
#include <utility>

#include "hardware/guard/guard_start.h"
#include "hardware/guard/quieting.h"
#include "hardware/guard/vigil.h"
#include "sim/core/errors.h"

namespace touchfield {

namespace {

constexpr double kPatience = 2;       // for an answer [s]; the link itself gives up after kLinkPatience
constexpr double kOpenPatience = 30;  // where a library is loaded or a network connected [s]

// Waits for a child's end.
// returns   its exit code; nothing if it does not end, or was ended by a signal
std::optional<int> exit_code_of(pid_t child) {
  const double end = steady_now() + kPatience;
  int status = 0;
  pid_t ended = 0;
  while ((ended = ::waitpid(child, &status, WNOHANG)) == 0 && steady_now() < end) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return ended == child && WIFEXITED(status) ? std::optional(WEXITSTATUS(status)) : std::nullopt;
}

}  // namespace

GuardedLink::GuardedLink(const std::vector<std::string>& command, const LinkSettings& settings,
                         const GuardLimits& limits)
    : channel_(-1) {
  const SocketPair ends;
  channel_.adopt(ends.own);
  watchdog_ = start_apart(command, {ends.others});
  ::close(ends.others);
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
  if (watchdog_ < 0) {
    return;
  }
  try {
    ask(GuardRequest::kClose);
  } catch (const std::exception&) {  // it stopped before, or does not answer: its end of the channel tells it
  }
  channel_.close();
  if (watchdog_ >= 0) {
    exit_code_of(std::exchange(watchdog_, -1));
  }
}

std::string GuardedLink::last_word() {
  const std::optional<int> code = watchdog_ >= 0 ? exit_code_of(std::exchange(watchdog_, -1)) : std::nullopt;
  return code == 0 ? "; its watchdog has quieted the array" : kMayBeOn;
}

GuardMessage GuardedLink::ask(GuardRequest request) { return ask(GuardMessage().put(request), kPatience); }

GuardMessage GuardedLink::ask(const GuardMessage& request, double patience) {
  // A guard that stopped of its own accord has left the reason in the channel.
  channel_.send(request);
  std::optional<GuardMessage> answer;
  try {
    answer = channel_.receive(patience);
  } catch (const IoError& error) {
    throw DeviceError(error.what() + std::string(kMayBeOn));
  }
  if (!answer) {
    throw DeviceError("link guard: it is gone" + last_word());
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
