#include "hardware/guard/guard_process.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <memory>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/stat.h>

#include <fmt/format.h>

#include "hardware/attention.h"
#include "hardware/guard/guard_message.h"
#include "hardware/stop_signals.h"
#include "sim/core/errors.h"
#include "sim/core/version.h"

namespace touchfield {

namespace {

constexpr double kLevelSlack = 1e-9;
constexpr double kForEver = std::numeric_limits<double>::infinity();
constexpr double kLongestSilence = 0.225;  // of the program [s]: with a look's period, it is found within 250 ms
constexpr double kReplyPatience = 0.2;     // [s]

class Guard {
 public:
  void run() {
    while (!ended_) {
      pollfd watched[2] = {{signals_.descriptor(), POLLIN, 0}, {program_.descriptor(), POLLIN, 0}};
      const double wait = std::clamp(deadline_ - steady_now(), 0.0, kPatienceStep);
      const int ready = ::poll(watched, 2, static_cast<int>(std::ceil(wait * 1e3)));
      if (overslept(wait)) {
        stop("it " + attention_.fault());
      } else if (ready > 0 && watched[0].revents != 0 && signals_.wait(0)) {
        stop(fmt::format("stopped by {}", StopSignals::name(signals_.signal())));
      } else if (steady_now() >= deadline_) {
        stop("the permitted time of emission is over");
      } else if (ready > 0 && watched[1].revents != 0) {
        serve();
        silence_ = Patience(kLongestSilence, steady_now());
      } else if (on_ && silence_.over(steady_now())) {
        stop("the program that drove the array said nothing for 250 ms");
      }
    }
    if (link_) {
      link_->close();
    }
  }

 private:
  // Whether the array was on and nobody looked.
  bool overslept(double planned) { return on_ && attention_.look(steady_now(), planned); }

  // Reads a request and answers it.
  void serve() {
    const std::optional<GuardMessage> request = program_.receive();
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
    if ((reply == GuardReply::kDeviceError || reply == GuardReply::kError) && open_) {
      refusal += "; " + release();
    }
    if (!tell(reply, reply == GuardReply::kDone ? std::move(with) : packed(refusal)) && !ended_) {
      stop("the program that drove the array is gone");
    }
  }

  GuardBytes answer(GuardRequest request, const GuardBytes& with) {
    if (request == GuardRequest::kStart) {
      const auto start = unpacked<GuardStart>(with);
      limits_ = start.limits;
      link_ = make_link(start.settings);
      return {};
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
    drive(request, with);
    return {};
  }

  // What needs an open device.
  void drive(GuardRequest request, const GuardBytes& with) {
    switch (request) {
      case GuardRequest::kModulation:
        link_->set_modulation(unpacked<Modulation>(with));
        return;
      case GuardRequest::kSend: {
        const auto frame = unpacked<DriveFrame>(with);
        require_permitted(frame);
        switch_on();
        link_->send(frame);
        return;
      }
      case GuardRequest::kStore: {
        const auto stored = unpacked<StoredFrames>(with);
        std::ranges::for_each(stored.frames, [&](const DriveFrame& frame) { require_permitted(frame); });
        link_->store(stored.first, stored.frames);
        return;
      }
      case GuardRequest::kPlayStored: {
        const auto play = unpacked<StoredPlay>(with);
        switch_on();
        link_->play_stored(play.count, play.rate);
        return;
      }
      case GuardRequest::kCheck:
        link_->check();
        return;
      case GuardRequest::kSilence:
        link_->silence();
        on_ = false;
        return;
      default:
        throw std::logic_error("link guard: an unknown request");
    }
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
      on_ = true;
      attention_.begin(steady_now());
    }
  }

  bool tell(GuardReply reply, GuardBytes with = {}) {
    return program_.send(GuardMessage(reply, std::move(with)), kReplyPatience);
  }

  // Silences the device, as far as the device still lets it, and asks nothing of it any more. Returns how that went.
  std::string release() {
    tell(GuardReply::kAlive);
    open_ = false;
    on_ = false;
    return silenced(*link_).text;
  }

  void stop(const std::string& reason) {
    const std::string text = open_ ? fmt::format("{}; {}", reason, release()) : reason;
    if (was_open_) {
      std::fputs(fmt::format("touchfield: link guard: {}\n", text).c_str(), stderr);
    }
    tell(GuardReply::kStopped, packed("link guard: " + text));
    ended_ = true;
  }

  StopSignals signals_;
  GuardChannel program_{Descriptor(kGuardDescriptor)};
  Patience silence_{kLongestSilence, steady_now()};  // with the program
  Attention attention_;
  GuardLimits limits_;
  std::unique_ptr<ArrayLink> link_;
  bool was_open_ = false;
  bool open_ = false;
  bool on_ = false;  // a frame was sent, and the device not silenced since
  bool ended_ = false;
  double deadline_ = kForEver;
};

}  // namespace

Silencing silenced(ArrayLink& link) {
  const double start = steady_now();
  try {
    link.silence();
    return {true, fmt::format("the array is silent after {:.0f} ms", (steady_now() - start) * 1e3)};
  } catch (const std::exception& error) {
    return {false, fmt::format("the array could not be silenced: {}{}", error.what(), kMayBeOn)};
  }
}

void run_guard() {
  struct stat status {};
  if (::fstat(kGuardDescriptor, &status) != 0 || !S_ISSOCK(status.st_mode)) {
    throw InputError("link guard: touchfield starts it when it drives an array; it is not for use by hand");
  }
  ::prctl(PR_SET_PDEATHSIG, SIGCONT);  // a stopped guard whose program ends continues, and sees that
  Guard().run();
}

}  // namespace touchfield
