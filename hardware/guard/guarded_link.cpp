#include "hardware/guard/guarded_link.h"

#include <chrono>
#include <optional>
#include <sys/wait.h>
#include <thread>
#include <utility>

#include "hardware/guard/guard_process.h"
#include "hardware/guard/guard_start.h"
#include "hardware/guard/vigil.h"
#include "sim/core/errors.h"

namespace touchfield {

namespace {

constexpr double kOpenPatience = 30;  // where a library is loaded or a network connected [s]

// Waits for a child's end.
// returns   its exit code; nothing if it does not end, or was ended by a signal
std::optional<int> exit_code_of(pid_t child) {
  const double end = steady_now() + kGuardPatience;
  int status = 0;
  pid_t ended = 0;
  while ((ended = ::waitpid(child, &status, WNOHANG)) == 0 && steady_now() < end) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return ended == child && WIFEXITED(status) ? std::optional(WEXITSTATUS(status)) : std::nullopt;
}

}  // namespace

GuardedLink::GuardedLink(const std::vector<std::string>& command, const LinkSettings& settings,
                         const GuardLimits& limits) {
  SocketPair ends;
  channel_ = GuardChannel(std::move(ends.own));
  watchdog_ = start_apart(command, {ends.others.number()});
  ends.others.close();
  try {
    const GuardMessage about = ask(GuardRequest::kStart, {{"limits", limits}, {"settings", settings}}, kOpenPatience);
    about.at("description").get_to(description_);
    about.at("abilities").get_to(abilities_);
    about.at("layout").get_to(layout_);
  } catch (...) {
    close();
    throw;
  }
}

GuardedLink::~GuardedLink() { close(); }

void GuardedLink::open() { ask(GuardRequest::kOpen, nullptr, kOpenPatience); }

void GuardedLink::set_modulation(const Modulation& modulation) { ask(GuardRequest::kModulation, modulation); }

void GuardedLink::send(const DriveFrame& frame) { ask(GuardRequest::kSend, frame); }

void GuardedLink::check() { ask(GuardRequest::kCheck); }

std::optional<DriveFrame> GuardedLink::read_back() {
  const GuardMessage frame = ask(GuardRequest::kReadBack);
  return frame.is_null() ? std::nullopt : std::optional(frame.get<DriveFrame>());
}

std::optional<std::vector<std::uint8_t>> GuardedLink::read_back_modulation() {
  const GuardMessage samples = ask(GuardRequest::kReadBackModulation);
  return samples.is_null() ? std::nullopt : std::optional(samples.get<std::vector<std::uint8_t>>());
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

GuardMessage GuardedLink::ask(GuardRequest request, const GuardMessage& with, double patience) {
  // A guard that stopped of its own accord has left the reason in the channel.
  channel_.send({{"request", request}, {"with", with}});
  std::optional<GuardMessage> answer;
  try {
    answer = channel_.receive(patience);
  } catch (const IoError& error) {
    throw DeviceError(error.what() + std::string(kMayBeOn));
  }
  if (!answer) {
    throw DeviceError("link guard: it is gone" + last_word());
  }
  GuardMessage& said = answer->at("with");
  switch (answer->at("reply").get<GuardReply>()) {
    case GuardReply::kDone:
      return std::move(said);
    case GuardReply::kInputError:
      throw InputError(said.get<std::string>());
    case GuardReply::kDeviceError:
    case GuardReply::kStopped:
      throw DeviceError(said.get<std::string>());
    case GuardReply::kError:
      break;
  }
  throw IoError(said.get<std::string>());
}

}  // namespace touchfield
