#include "hardware/guard/vigil.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <fcntl.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <fmt/format.h>

#include "sim/core/errors.h"

namespace touchfield {

void Silence::heard(double now) {
  last_ = now;
  silent_ = 0;
}

bool Silence::look(double now, const ProcessState& state) {
  silent_ += std::min(state.letter == 'R' ? state.worked - worked_ : now - last_, kLongestLook);
  last_ = now;
  worked_ = state.worked;
  return silent_ >= kLongestSilence;
}

Vigil::Vigil(pid_t process, double now)
    : number_(process), process_(static_cast<int>(::syscall(SYS_pidfd_open, process, 0))), silence_(now) {
  const std::string path = fmt::format("/proc/{}/stat", process);
  file_ = Descriptor(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  if (file_.number() < 0) {
    throw IoError(fmt::format("link guard: {} cannot be read: {}", path, std::strerror(errno)));
  }
}

std::optional<std::string> Vigil::fault(double now) {
  const std::optional<ProcessState> seen = state();
  if (!seen) {
    return std::nullopt;  // its channel tells that it is gone
  }
  const bool silent = silence_.look(now, *seen);
  if (seen->letter == 'T') {
    return "was stopped by a signal";
  }
  if (!silent) {
    return std::nullopt;
  }
  return seen->letter == 't' ? "was held by a debugger" : "said nothing for 250 ms";
}

bool Vigil::is_stopped() const {
  const std::optional<ProcessState> seen = state();
  return seen && seen->letter == 'T';
}

void Vigil::resume() const {
  if (process_.number() < 0) {
    ::kill(number_, SIGCONT);
    return;
  }
  ::syscall(SYS_pidfd_send_signal, process_.number(), SIGCONT, nullptr, 0);
}

std::optional<ProcessState> Vigil::state() const {
  std::array<char, 1024> text{};
  const ssize_t size = ::pread(file_.number(), text.data(), text.size() - 1, 0);
  // PID (NAME) STATE and ten numbers, then the times in user and kernel mode; NAME may hold anything.
  const char* rest = size > 0 ? std::strrchr(text.data(), ')') : nullptr;
  ProcessState state;
  unsigned long user = 0;
  unsigned long kernel = 0;
  if (rest == nullptr ||
      std::sscanf(rest, ") %c %*s %*s %*s %*s %*s %*s %*s %*s %*s %*s %lu %lu", &state.letter, &user, &kernel) != 3) {
    return std::nullopt;
  }
  state.worked = static_cast<double>(user + kernel) / static_cast<double>(::sysconf(_SC_CLK_TCK));
  return state;
}

}  // namespace touchfield
