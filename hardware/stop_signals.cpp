#include "hardware/stop_signals.h"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <poll.h>
#include <pthread.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/core/version.h"

namespace touchfield {

sigset_t StopSignals::polite() {
  sigset_t set;
  sigemptyset(&set);
  sigaddset(&set, SIGINT);
  sigaddset(&set, SIGTERM);
  sigaddset(&set, SIGHUP);
  sigaddset(&set, SIGXCPU);
  return set;
}

sigset_t StopSignals::all() {
  sigset_t set;
  sigfillset(&set);
  for (const int harmless : {SIGCHLD, SIGCONT, SIGURG, SIGWINCH}) {
    sigdelset(&set, harmless);
  }
  return set;
}

StopSignals::StopSignals() {
  const sigset_t set = all();
  pthread_sigmask(SIG_BLOCK, &set, &before_);
  descriptor_ = ::signalfd(-1, &set, SFD_CLOEXEC | SFD_NONBLOCK);
  if (descriptor_ < 0) {
    throw IoError(fmt::format("signals cannot be waited for: {}", std::strerror(errno)));
  }
}

StopSignals::~StopSignals() {
  ::close(descriptor_);
  pthread_sigmask(SIG_SETMASK, &before_, nullptr);
}

bool StopSignals::wait(double seconds) {
  if (signal_ != 0) {
    return true;
  }
  pollfd watched{descriptor_, POLLIN, 0};
  const double whole = std::floor(std::clamp(seconds, 0.0, 1e6));
  const double rest = std::clamp(seconds, 0.0, 1e6) - whole;
  const timespec time{static_cast<time_t>(whole), static_cast<long>(rest * 1e9)};
  if (::ppoll(&watched, 1, &time, nullptr) <= 0) {
    return false;
  }
  signalfd_siginfo info{};
  if (::read(descriptor_, &info, sizeof info) == static_cast<ssize_t>(sizeof info)) {
    signal_ = static_cast<int>(info.ssi_signo);
  }
  return signal_ != 0;
}

std::string StopSignals::name(int signal) {
  const char* abbreviation = ::sigabbrev_np(signal);  // a real-time signal has none
  return abbreviation != nullptr ? fmt::format("SIG{}", abbreviation) : fmt::format("signal {}", signal);
}

double SignalledPace::now() { return steady_now(); }

bool SignalledPace::wait_until(double t) {
  const double planned = std::max(0.0, t - now());
  do {
    if (signals_.wait(t - now())) {
      look(planned);
      return false;
    }
  } while (now() < t);
  look(planned);
  return !overslept_;
}

}  // namespace touchfield
