#include "hardware/guard/guard_process.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <limits>
#include <memory>
#include <poll.h>
#include <string>
#include <sys/stat.h>

#include <fmt/format.h>

#include "hardware/guard/guard_channel.h"
#include "hardware/stop_signals.h"
#include "sim/core/errors.h"

namespace touchfield {

namespace {

constexpr double kCheckPeriod = 0.05;      // [s] between looks at a device that is sent nothing
constexpr double kMessagePatience = 0.05;  // for the rest of a message that has begun [s]
constexpr double kLevelSlack = 1e-9;
constexpr int kDeviceFailed = 4;

double now() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

class Guard {
 public:
  explicit Guard(int descriptor) : channel_(descriptor) {}

  int run() {
    while (!ended_) {
      pollfd watched[2] = {{signals_.descriptor(), POLLIN, 0}, {channel_.descriptor(), POLLIN, 0}};
      const double wait = std::min(deadline_ - now(), open_ ? kCheckPeriod : 1e3);
      const int ready = ::poll(watched, 2, static_cast<int>(std::ceil(std::clamp(wait, 0.0, 1e3) * 1e3)));
      if (ready > 0 && watched[0].revents != 0 && signals_.wait(0)) {
        stop(fmt::format("stopped by {}", StopSignals::name(signals_.signal())));
      } else if (now() >= deadline_) {
        stop("the time is over that it may emit");
      } else if (ready > 0 && watched[1].revents != 0) {
        serve();
      } else if (open_) {
        look();
      }
    }
    return exit_code_;
  }

 private:
  // Reads a request and answers it.
  void serve() {
    std::optional<GuardMessage> request;
    try {
      request = channel_.receive(kMessagePatience);
    } catch (const IoError& error) {
      stop(error.what());
      return;
    }
    if (!request) {
      stop("the program that drove the array is gone");
      return;
    }
    GuardMessage reply;
    try {
      GuardMessage answer = answered(*request);
      reply.put(GuardReply::kDone);
      reply.append(answer);
    } catch (const InputError& error) {
      reply.put(GuardReply::kInputError).put(std::string(error.what()));
    } catch (const DeviceError& error) {
      reply.put(GuardReply::kDeviceError).put(fmt::format("{}{}", error.what(), after_loss()));
    } catch (const std::exception& error) {
      reply.put(GuardReply::kError).put(fmt::format("{}{}", error.what(), after_loss()));
    }
    if (!channel_.send(reply) && !ended_) {
      stop("the program that drove the array is gone");
    }
  }

  GuardMessage answered(GuardMessage& request) {
    GuardMessage answer;
    const auto what = static_cast<GuardRequest>(request.take_number());
    if (what == GuardRequest::kStart) {
      limits_.level = request.take_real();
      limits_.seconds = request.take_real();
      link_ = make_link(request.take_settings());
      answer.put(link_->describe()).put(link_->abilities()).put(link_->layout());
      return answer;
    }
    if (what == GuardRequest::kClose) {
      ended_ = true;
      if (open_ && !quieted_) {
        release();
      } else if (open_) {
        link_->close();
      }
      return answer;
    }
    if (!link_) {
      throw std::logic_error("link guard: a request before the start");
    }
    if (what == GuardRequest::kOpen) {
      if (was_open_) throw DeviceError("link guard: nothing resumes by itself");
      was_open_ = true;
      try {
        link_->open();
      } catch (...) {
        link_->close();
        throw;
      }
      open_ = true;
      return answer;
    }
    if (!open_) {
      throw DeviceError("link guard: the device is not open");
    }
    serve_open(what, request, answer);
    return answer;
  }

  // What needs an open device.
  void serve_open(GuardRequest what, GuardMessage& request, GuardMessage& answer) {
    switch (what) {
      case GuardRequest::kModulation:
        link_->set_modulation(request.take_modulation());
        return;
      case GuardRequest::kSend:
        send(request.take_frame());
        return;
      case GuardRequest::kCheck:
        link_->check();
        return;
      case GuardRequest::kReadBack: {
        const std::optional<DriveFrame> frame = link_->read_back();
        answer.put(std::uint32_t{frame.has_value()});
        if (frame) answer.put(*frame);
        return;
      }
      case GuardRequest::kReadBackModulation: {
        const std::optional<std::vector<std::uint8_t>> samples = link_->read_back_modulation();
        answer.put(std::uint32_t{samples.has_value()});
        if (samples) answer.put(*samples);
        return;
      }
      case GuardRequest::kQuiet:
        link_->quiet();
        quieted_ = true;
        return;
      default:
        throw std::logic_error("link guard: an unknown request");
    }
  }

  void send(const DriveFrame& frame) {
    const double level = level_of(frame, link_->abilities().steps);
    if (level > limits_.level + kLevelSlack) {
      throw InputError(fmt::format("level = {:.3f} must be <= {:g}", level, limits_.level));
    }
    if (deadline_ == std::numeric_limits<double>::infinity()) {
      deadline_ = now() + limits_.seconds + kGuardGrace;
    }
    quieted_ = false;
    link_->send(frame);
  }

  void look() {
    try {
      link_->check();
    } catch (const std::exception& error) {
      stop(error.what());
    }
  }

  // Quiets and lets go, as far as the device still lets it. Returns how that went.
  std::string release() {
    const double start = now();
    std::string outcome;
    try {
      link_->quiet();
      const std::optional<DriveFrame> state = link_->read_back();
      const bool loud = state && level_of(*state, link_->abilities().steps) > 0;
      outcome = fmt::format("{} after {:.0f} ms",
                            loud    ? "the array says that it is still on"
                            : state ? "the array is quiet, as it says itself,"
                                    : "the array is quiet",
                            (now() - start) * 1e3);
      exit_code_ = loud ? kDeviceFailed : exit_code_;
    } catch (const std::exception& error) {
      outcome = fmt::format("the array could not be quieted: {}", error.what());
      exit_code_ = kDeviceFailed;
    }
    link_->close();
    open_ = false;
    return outcome;
  }

  // Words to add to an error that an open device may not survive.
  std::string after_loss() { return open_ ? "; " + release() : ""; }

  void stop(const std::string& reason) {
    const std::string text = open_ ? fmt::format("{}; {}", reason, release()) : reason;
    if (was_open_) {
      std::fputs(fmt::format("touchfield: link guard: {}\n", text).c_str(), stderr);
    }
    channel_.send(GuardMessage().put(GuardReply::kStopped).put("link guard: " + text));
    ended_ = true;
  }

  StopSignals signals_;
  GuardChannel channel_;
  GuardLimits limits_;
  std::unique_ptr<ArrayLink> link_;
  bool was_open_ = false;
  bool open_ = false;
  bool quieted_ = false;  // on request, and nothing was sent since
  bool ended_ = false;
  double deadline_ = std::numeric_limits<double>::infinity();
  int exit_code_ = 0;
};

}  // namespace

int run_guard(int descriptor) {
  struct stat status {};
  if (::fstat(descriptor, &status) != 0 || !S_ISSOCK(status.st_mode)) {
    throw InputError("link guard: it is started by whoever drives an array, not by hand");
  }
  std::signal(SIGPIPE, SIG_IGN);  // of a closed terminal, say: the array must be quieted all the same
  return Guard(descriptor).run();
}

}  // namespace touchfield
