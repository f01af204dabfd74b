#include "hardware/guard/guarded_link.h"

#include <chrono>
#include <csignal>
#include <sys/wait.h>
#include <thread>
#include <utility>

#include "hardware/guard/guard_process.h"
#include "hardware/guard/guard_start.h"
#include "sim/core/errors.h"
#include "sim/core/steady_now.h"

namespace touchfield {

namespace {

constexpr double kOpenPatience = 30;  // where a library is loaded or a network connected [s]

}  // namespace

GuardedLink::GuardedLink(const std::vector<std::string>& command, const LinkSettings& settings,
                         const GuardLimits& limits) {
  SocketPair ends;
  channel_ = GuardChannel(std::move(ends.own));
  watchdog_ = start_apart(command, {ends.others.number()});
  ends.others.close();
  try {
    const GuardBytes about = ask(GuardRequest::kStart, packed(GuardStart{limits, settings}), kOpenPatience);
    device_ = unpacked<GuardedDevice>(about);
    guard_.emplace(device_.guard, steady_now());
  } catch (...) {
    close();
    throw;
  }
}

GuardedLink::~GuardedLink() { close(); }

void GuardedLink::open() { ask(GuardRequest::kOpen, {}, kOpenPatience); }

void GuardedLink::set_modulation(const Modulation& modulation) { ask(GuardRequest::kModulation, packed(modulation)); }

void GuardedLink::send(const DriveFrame& frame) { ask(GuardRequest::kSend, packed(frame)); }

void GuardedLink::store(std::size_t first, const std::vector<DriveFrame>& frames) {
  ask(GuardRequest::kStore, packed(StoredFrames{first, frames}));
}

void GuardedLink::play_stored(std::size_t count, double rate) {
  ask(GuardRequest::kPlayStored, packed(StoredPlay{count, rate}));
}

void GuardedLink::check() { ask(GuardRequest::kCheck); }

void GuardedLink::quiet() { ask(GuardRequest::kQuiet); }

void GuardedLink::close() noexcept {
  if (watchdog_ < 0) {
    return;
  }
  try {
    gaps_ = unpacked<Gaps>(ask(GuardRequest::kClose));
  } catch (const std::exception&) {  // it stopped before, or does not answer: its end of the channel tells it
  }
  channel_.close();
  if (answers_) {
    end_of_watchdog();
  }
}

void GuardedLink::resume_others() const {
  if (watchdog_ > 0) {
    ::kill(watchdog_, SIGCONT);
  }
  if (guard_) {
    guard_->resume();
  }
}

std::optional<int> GuardedLink::end_of_watchdog() {
  resume_others();
  const pid_t child = std::exchange(watchdog_, -1);
  if (child < 0) {
    return std::nullopt;
  }
  Patience patience(kEndPatience, steady_now());
  int status = 0;
  pid_t ended = 0;
  while ((ended = ::waitpid(child, &status, WNOHANG)) == 0 && !patience.over(steady_now())) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return ended == child && WIFEXITED(status) ? std::optional(WEXITSTATUS(status)) : std::nullopt;
}

std::string GuardedLink::last_word() {
  return end_of_watchdog() == 0 ? "; its watchdog has quieted the array" : kMayBeOn;
}

GuardBytes GuardedLink::ask(GuardRequest request, GuardBytes with, double patience) {
  const auto no_answer = [] { return DeviceError(std::string("link guard: no answer") + kMayBeOn); };
  if (!answers_) {
    throw no_answer();
  }
  // A guard that stopped of its own accord has left the reason in the channel.
  channel_.send(GuardMessage(request, std::move(with)));
  const bool waited = !channel_.waits(kLinkPatience);
  const bool stopped = waited && guard_ && guard_->is_stopped();
  if (waited) {
    resume_others();
  }
  std::optional<GuardMessage> answer;
  try {
    answer = channel_.receive(patience);
  } catch (const IoError&) {
    answers_ = false;
    throw no_answer();
  }
  if (!answer) {
    throw DeviceError("link guard: it is gone" + last_word());
  }
  has_told_ = has_told_ || static_cast<GuardReply>(answer->what) == GuardReply::kStopped;
  switch (static_cast<GuardReply>(answer->what)) {
    case GuardReply::kDone:
      // With its watchdog stopped too, nobody but this process has seen it.
      if (stopped && request != GuardRequest::kQuiet && request != GuardRequest::kClose) {
        quiet();
        throw DeviceError("link guard: was stopped by a signal; the array is quiet");
      }
      return std::move(answer->with);
    case GuardReply::kInputError:
      throw InputError(unpacked<std::string>(answer->with));
    case GuardReply::kDeviceError:
    case GuardReply::kStopped:
      throw DeviceError(unpacked<std::string>(answer->with));
    case GuardReply::kError:
      break;
  }
  throw IoError(unpacked<std::string>(answer->with));
}

}  // namespace touchfield
