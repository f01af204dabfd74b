#include "sim/core/whole_file.h"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdint>
#include <cstring>
#include <fcntl.h>
#include <poll.h>
#include <sys/stat.h>
#include <thread>
#include <unistd.h>

#include <fmt/format.h>

#include "sim/core/child_process.h"
#include "sim/core/errors.h"

namespace touchfield {

namespace {

constexpr std::chrono::seconds kPatienceForWriter{2};  // of a pipe to be opened by another process
constexpr int kPatienceForBytes = 60;                  // [s] of a pipe that is open

[[noreturn]] void refuse(const std::string& path, const std::string& what) {
  throw InputError(fmt::format("{}: {}", path, what));
}

[[noreturn]] void refuse_reading(const std::string& path) {
  const int reason = errno;
  refuse(path, reason == ENOENT  ? "no such file"
               : reason == ENXIO ? "a socket, must be a file"
                                 : fmt::format("cannot be read: {}", std::strerror(reason)));
}

void require_length(const std::string& path, std::uintmax_t bytes, std::size_t most) {
  if (bytes > most) {
    refuse(path, fmt::format("too long, must be at most {} bytes", most));
  }
}

/// Opened without waiting for the other end of a pipe. Nothing of a device is touched: a terminal would wait for ever.
Descriptor opened_for_reading(const std::string& path, struct stat& about) {
  const auto require_kind = [&] {
    if (S_ISDIR(about.st_mode)) {
      refuse(path, "a directory, must be a file");
    }
    if (S_ISCHR(about.st_mode) || S_ISBLK(about.st_mode)) {
      refuse(path, "a device, must be a file");
    }
  };
  if (::stat(path.c_str(), &about) != 0) {
    refuse_reading(path);
  }
  require_kind();
  Descriptor file(::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_NOCTTY | O_CLOEXEC));
  if (file.number() < 0 || ::fstat(file.number(), &about) != 0) {
    refuse_reading(path);
  }
  require_kind();
  return file;
}

/// Reads what there is, at most `size` bytes; waits for what comes through a pipe. 0 at the end.
std::size_t read_some(int file, char* bytes, std::size_t size, const std::string& path) {
  while (true) {
    const ssize_t got = ::read(file, bytes, size);
    if (got >= 0) {
      return static_cast<std::size_t>(got);
    }
    if (errno == EAGAIN || errno == EWOULDBLOCK) {
      pollfd waiting{file, POLLIN, 0};
      if (::poll(&waiting, 1, 1000 * kPatienceForBytes) == 0) {
        refuse(path, fmt::format("a pipe, and nothing has come for {} s; give a file", kPatienceForBytes));
      }
    } else if (errno != EINTR) {
      refuse_reading(path);
    }
  }
}

}  // namespace

std::string read_whole_file(const std::string& path, std::size_t most) {
  struct stat about {};
  const Descriptor file = opened_for_reading(path, about);
  if (S_ISREG(about.st_mode)) {
    require_length(path, static_cast<std::uintmax_t>(about.st_size), most);
  }
  constexpr std::size_t kBlock = 1U << 16U;
  const auto begin = std::chrono::steady_clock::now();
  std::string text;
  while (true) {
    const std::size_t size = text.size();
    text.resize(size + kBlock);
    const std::size_t got = read_some(file.number(), text.data() + size, kBlock, path);
    text.resize(size + got);
    require_length(path, text.size(), most);
    if (got > 0) {
      continue;
    }
    if (!text.empty() || !S_ISFIFO(about.st_mode)) {
      return text;
    }
    // A pipe that nobody writes to is at its end as well.
    if (std::chrono::steady_clock::now() - begin > kPatienceForWriter) {
      refuse(path, "a pipe, and nothing writes to it; give a file");
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
}

}  // namespace touchfield
