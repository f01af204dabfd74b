#include "hardware/guard/vigil.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <fcntl.h>
#include <unistd.h>

#include <fmt/format.h>

#include "sim/core/errors.h"

namespace touchfield {

double steady_now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

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

Vigil::Vigil(pid_t process, double now) : silence_(now) {
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
  return silent ? std::optional<std::string>("said nothing for 250 ms") : std::nullopt;
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
