#include "hardware/guard/vigil.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <fcntl.h>
#include <string_view>
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

bool Silence::look(double now) {
  silent_ += std::min(now - last_, kLongestLook);
  last_ = now;
  return silent_ >= kLongestSilence;
}

Vigil::Vigil(pid_t process, double now) : silence_(now) {
  const std::string path = fmt::format("/proc/{}/stat", process);
  state_ = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (state_ < 0) {
    throw IoError(fmt::format("link guard: {} cannot be read: {}", path, std::strerror(errno)));
  }
}

Vigil::~Vigil() { ::close(state_); }

std::optional<std::string> Vigil::fault(double now) {
  const bool silent = silence_.look(now);
  if (stopped()) {
    return "was stopped by a signal";
  }
  return silent ? std::optional<std::string>("said nothing for 250 ms") : std::nullopt;
}

bool Vigil::stopped() const {
  std::array<char, 512> text{};
  const ssize_t size = ::pread(state_, text.data(), text.size(), 0);
  if (size <= 0) {
    return false;  // it is gone, which its channel tells
  }
  // PID (NAME) STATE ..., and a name may hold anything.
  const std::string_view line(text.data(), static_cast<std::size_t>(size));
  return line.substr(std::min(line.rfind(')'), line.size())).starts_with(") T");
}

}  // namespace touchfield
