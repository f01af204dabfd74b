#include "hardware/guard/watchdog_process.h"

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <optional>
#include <poll.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fmt/format.h>

#include "hardware/attention.h"
#include "hardware/guard/guard_channel.h"
#include "hardware/guard/guard_process.h"
#include "hardware/guard/guard_start.h"
#include "hardware/guard/vigil.h"
#include "hardware/stop_signals.h"
#include "sim/core/errors.h"
#include "sim/core/steady_now.h"

namespace touchfield {

namespace {

class Watchdog {
 public:
  Watchdog(pid_t guard, Descriptor descriptor)
      : guard_(guard), channel_(std::move(descriptor)), vigil_(guard, steady_now()) {}

  int run() {
    int status = 0;
    while (::waitpid(guard_, &status, WNOHANG) == 0) {
      // Once the channel is closed the guard is about to be gone.
      const int wait = channel_.descriptor() < 0 ? 1 : static_cast<int>(kLookPeriod * 1e3);
      pollfd watched[2] = {{signals_.descriptor(), POLLIN, 0}, {channel_.descriptor(), POLLIN, 0}};
      const int ready = ::poll(watched, 2, wait);
      if (ready > 0 && watched[0].revents != 0 && signals_.wait(0) && !passed_on_) {
        passed_on_ = true;
        ::kill(guard_, signals_.signal());
      }
      if (ready > 0 && watched[1].revents != 0) {
        hear();
      }
      look(wait * 1e-3);
    }
    while (channel_.descriptor() >= 0) {
      hear();  // its last words
    }
    return ended(status);
  }

 private:
  void hear() {
    std::optional<GuardMessage> message;
    try {
      message = channel_.receive(kMessagePatience);
    } catch (const IoError&) {  // NOLINT(bugprone-empty-catch): its guard died in the middle of a message
    }
    if (!message) {
      channel_.close();
      return;
    }
    vigil_.heard(steady_now());
    if (message->what == kSignOfLife) {
      return;
    }
    const auto note = static_cast<GuardNote>(message->what);
    if (note == GuardNote::kDevice) {
      device_ = unpacked<LinkSettings>(message->with);
    } else {
      on_ = note == GuardNote::kOn;
      attention_.begin(steady_now());
    }
  }

  // Beats, and does what it can about a guard that does not run.
  void look(double planned) {
    const double now = steady_now();
    if (on_ && attention_.look(now, planned)) {
      overslept_at_ = now;
    }
    if (now < next_look_) {
      return;
    }
    next_look_ = now + kLookPeriod;
    if (channel_.descriptor() >= 0) {
      channel_.beat();
    }
    const std::optional<std::string> fault = on_ ? vigil_.fault(now) : std::nullopt;
    if (!fault) {
      fault_since_.reset();
      // Unless this process alone was away, the guard has seen the same and acts.
      if (on_ && overslept_at_ && now - *overslept_at_ >= kMercy) {
        overslept_at_.reset();
        tell("it " + attention_.fault());
        ::kill(guard_, SIGTERM);
      }
      return;
    }
    found_ = *fault;
    if (!fault_since_) {
      fault_since_ = now;
    }
    if (now - *fault_since_ >= kMercy) {
      ::kill(guard_, SIGKILL);
      if (now - *fault_since_ >= kHopeless && !hopeless_) {
        hopeless_ = true;
        tell(fmt::format("its guard {} and cannot be ended{}", found_, kMayBeOn));
      }
      return;
    }
    ::kill(guard_, SIGTERM);
    ::kill(guard_, SIGCONT);
  }

  int ended(int status) {
    if (on_) {
      const std::string reason = WIFSIGNALED(status) && found_.empty()
                                     ? fmt::format("was ended by {}", StopSignals::name(WTERMSIG(status)))
                                 : found_.empty() ? "ended without quieting the array"
                                                  : found_;
      const Quieting done = take_over();
      tell(fmt::format("its guard {}; {}", reason, done.text));
      return done.quiet ? 0 : kDeviceFailed;
    }
    if (!found_.empty()) {
      tell(fmt::format("its guard {} and was woken by a signal", found_));
    }
    return WIFEXITED(status) ? WEXITSTATUS(status) : 0;
  }

  // Quiets the device that a guard has left.
  Quieting take_over() {
    try {
      link_ = make_link(device_);
      link_->take_over();
      return quieted(*link_);
    } catch (const std::exception& error) {
      return {false, fmt::format("the array could not be quieted: {}{}", error.what(), kMayBeOn)};
    }
  }

  static void tell(const std::string& what) {
    std::fputs(fmt::format("touchfield: link watchdog: {}\n", what).c_str(), stderr);
  }

  StopSignals signals_;
  pid_t guard_;
  GuardChannel channel_;
  Vigil vigil_;
  Attention attention_;
  LinkSettings device_;
  std::unique_ptr<ArrayLink> link_;  // to it, once it is its guard's no more
  bool on_ = false;                  // by the guard's word the device may emit
  bool passed_on_ = false;           // a signal
  double next_look_ = 0;
  std::optional<double> overslept_at_;
  std::optional<double> fault_since_;
  bool hopeless_ = false;
  std::string found_;  // the last fault
};

}  // namespace

int run_watchdog(int descriptor, const std::vector<std::string>& guard_command) {
  require_handed_over(1);
  wake_at_parents_end();
  Descriptor programs(descriptor);
  SocketPair ends;
  const pid_t guard = start_apart(guard_command, {programs.number(), ends.others.number()});
  programs.close();
  ends.others.close();
  return Watchdog(guard, std::move(ends.own)).run();
}

}  // namespace touchfield
