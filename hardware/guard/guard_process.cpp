#include "hardware/guard/guard_process.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <memory>
#include <poll.h>
#include <string>
#include <unistd.h>

#include <fmt/format.h>

#include "hardware/attention.h"
#include "hardware/guard/guard_channel.h"
#include "hardware/guard/guard_start.h"
#include "hardware/guard/vigil.h"
#include "hardware/stop_signals.h"
#include "sim/core/errors.h"
#include "sim/core/steady_now.h"

namespace touchfield {

namespace {

constexpr double kLevelSlack = 1e-9;
constexpr double kForEver = std::numeric_limits<double>::infinity();

class Guard {
 public:
  explicit Guard(int descriptor)
      : program_(Descriptor(descriptor)),
        watchdog_(Descriptor(descriptor + 1)),
        program_vigil_(program_.maker(), steady_now()),
        watchdog_vigil_(watchdog_.maker(), steady_now()) {}

  int run() {
    double next_look = steady_now();
    while (!ended_) {
      pollfd watched[3] = {
          {signals_.descriptor(), POLLIN, 0}, {watchdog_.descriptor(), POLLIN, 0}, {program_.descriptor(), POLLIN, 0}};
      const double wait = std::max(0.0, std::min(deadline_, next_look) - steady_now());
      const int ready = ::poll(watched, 3, static_cast<int>(std::ceil(wait * 1e3)));
      if (overslept(wait)) {
        stop("it " + attention_.fault());
      } else if (ready > 0 && watched[0].revents != 0 && signals_.wait(0)) {
        stop(fmt::format("stopped by {}", StopSignals::name(signals_.signal())));
      } else if (steady_now() >= deadline_) {
        stop("the permitted time of emission is over");
      } else if (ready > 0 && watched[1].revents != 0) {
        hear_watchdog();
      } else if (ready > 0 && watched[2].revents != 0) {
        serve();
      }
      if (!ended_ && steady_now() >= next_look) {
        next_look = steady_now() + kLookPeriod;
        look();
      }
    }
    watchdog_vigil_.resume();  // it ends with its guard, also if it was stopped
    if (link_) {
      link_->close();
    }
    return exit_code_;
  }

 private:
  // Whether the array was on and nobody looked.
  bool overslept(double planned) { return on_ && attention_.look(steady_now(), planned); }

  void hear_watchdog() {
    if (!received(watchdog_)) {
      stop("its watchdog is gone");
      return;
    }
    watchdog_vigil_.heard(steady_now());
  }

  // Nothing also if what comes is no message: who sends that is as good as gone.
  static std::optional<GuardMessage> received(GuardChannel& channel) {
    try {
      return channel.receive(kMessagePatience);
    } catch (const IoError&) {
      return std::nullopt;
    }
  }

  // While it may emit, the program and the watchdog have to run.
  void look() {
    watchdog_.beat();
    if (!on_) {
      return;
    }
    if (const auto fault = program_vigil_.fault(steady_now())) {
      stop("the program that drove the array " + *fault);
    } else if (const auto other = watchdog_vigil_.fault(steady_now())) {
      stop("its watchdog " + *other);
    }
  }

  // Reads a request and answers it.
  void serve() {
    const std::optional<GuardMessage> request = received(program_);
    if (!request) {
      stop("the program that drove the array is gone");
      return;
    }
    auto reply = GuardReply::kDone;
    GuardBytes with;
    std::string refusal;
    try {
      with = answer(static_cast<GuardRequest>(request->what), request->with);
    } catch (const InputError& error) {
      reply = GuardReply::kInputError;
      refusal = error.what();
    } catch (const DeviceError& error) {
      reply = GuardReply::kDeviceError;
      refusal = error.what();
    } catch (const std::exception& error) {
      reply = GuardReply::kError;
      refusal = error.what();
    }
    if (overslept(0)) {  // which may be all that the device's error is
      stop("it " + attention_.fault());
      return;
    }
    if (reply == GuardReply::kDeviceError || reply == GuardReply::kError) {
      refusal += after_loss();
    }
    if (!program_.send(GuardMessage(reply, reply == GuardReply::kDone ? std::move(with) : packed(refusal))) &&
        !ended_) {
      stop("the program that drove the array is gone");
    }
    program_vigil_.heard(steady_now());
  }

  GuardBytes answer(GuardRequest request, const GuardBytes& with) {
    if (request == GuardRequest::kStart) {
      const auto start = unpacked<GuardStart>(with);
      limits_ = start.limits;
      watchdog_.send(GuardMessage(GuardNote::kDevice, packed(start.settings)));
      link_ = make_link(start.settings);
      return packed(GuardedDevice{link_->describe(), link_->abilities(), link_->layout(), ::getpid()});
    }
    if (request == GuardRequest::kClose) {
      ended_ = true;
      if (on_) {
        release();
      }
      return packed(attention_.gaps());
    }
    if (!link_) {
      throw std::logic_error("link guard: a request before the start");
    }
    if (request == GuardRequest::kOpen) {
      if (was_open_) throw DeviceError("link guard: nothing resumes by itself");
      was_open_ = true;
      try {
        link_->open();
      } catch (...) {
        link_->close();
        throw;
      }
      open_ = true;
      return {};
    }
    if (!open_) {
      throw DeviceError("link guard: the device is not open");
    }
    return answer_open(request, with);
  }

  // What needs an open device.
  GuardBytes answer_open(GuardRequest request, const GuardBytes& with) {
    switch (request) {
      case GuardRequest::kModulation:
        link_->set_modulation(unpacked<Modulation>(with));
        return {};
      case GuardRequest::kSend:
        send(unpacked<DriveFrame>(with));
        return {};
      case GuardRequest::kStore: {
        const auto stored = unpacked<StoredFrames>(with);
        for (const DriveFrame& frame : stored.frames) {
          require_permitted(frame);
        }
        link_->store(stored.first, stored.frames);
        return {};
      }
      case GuardRequest::kPlayStored: {
        const auto play = unpacked<StoredPlay>(with);
        switch_on();
        link_->play_stored(play.count, play.rate);
        return {};
      }
      case GuardRequest::kCheck:
        link_->check();
        return {};
      case GuardRequest::kQuiet:
        link_->quiet();
        note(false);
        return {};
      default:
        throw std::logic_error("link guard: an unknown request");
    }
  }

  void send(const DriveFrame& frame) {
    require_permitted(frame);
    switch_on();
    link_->send(frame);
  }

  void require_permitted(const DriveFrame& frame) const {
    const double level = level_of(frame, link_->abilities().steps);
    if (level > limits_.level + kLevelSlack) {
      throw InputError(fmt::format("level = {:.3f} must be <= {:g}", level, limits_.level));
    }
  }

  // The device may emit from now on.
  void switch_on() {
    if (deadline_ == kForEver) {
      deadline_ = steady_now() + limits_.seconds + kGuardGrace;
    }
    if (!on_) {
      note(true);
      attention_.begin(steady_now());
    }
  }

  // Whether the device may emit, told to the watchdog before that begins and after it has ended.
  void note(bool on) {
    on_ = on;
    watchdog_.send(GuardMessage(on ? GuardNote::kOn : GuardNote::kOff));
  }

  // Quiets, as far as the device still lets it, and asks nothing of it any more. Returns how that went.
  std::string release() {
    watchdog_.beat();
    const Quieting done = quieted(*link_);
    exit_code_ = done.quiet ? exit_code_ : kDeviceFailed;
    open_ = false;
    note(false);
    return done.text;
  }

  // Words to add to an error that an open device may not survive.
  std::string after_loss() { return open_ ? "; " + release() : ""; }

  void stop(const std::string& reason) {
    const std::string text = open_ ? fmt::format("{}; {}", reason, release()) : reason;
    if (was_open_) {
      std::fputs(fmt::format("touchfield: link guard: {}\n", text).c_str(), stderr);
    }
    program_.send(GuardMessage(GuardReply::kStopped, packed("link guard: " + text)));
    ended_ = true;
  }

  StopSignals signals_;
  GuardChannel program_;
  GuardChannel watchdog_;
  Vigil program_vigil_;
  Vigil watchdog_vigil_;
  Attention attention_;
  GuardLimits limits_;
  std::unique_ptr<ArrayLink> link_;
  bool was_open_ = false;
  bool open_ = false;
  bool on_ = false;  // a frame was sent, and the device not quieted since
  bool ended_ = false;
  double deadline_ = kForEver;
  int exit_code_ = 0;
};

}  // namespace

Quieting quieted(ArrayLink& link) {
  const double start = steady_now();
  Quieting done;
  try {
    link.quiet();
    done.quiet = true;
    done.text = fmt::format("the array is quiet after {:.0f} ms", (steady_now() - start) * 1e3);
  } catch (const std::exception& error) {
    done.text = fmt::format("the array could not be quieted: {}{}", error.what(), kMayBeOn);
  }
  return done;
}

int run_guard(int descriptor) {
  require_handed_over(2);
  wake_at_parents_end();
  return Guard(descriptor).run();
}

}  // namespace touchfield
