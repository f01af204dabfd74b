#include "sim/core/isolated_work.h"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <fcntl.h>
#include <fstream>
#include <new>
#include <poll.h>
#include <stdexcept>
#include <string>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <system_error>
#include <unistd.h>

#include <fmt/format.h>

#include "sim/core/child_process.h"
#include "sim/core/errors.h"
#include "sim/core/require.h"

namespace touchfield {

namespace {

constexpr int kRefused = 2;                    // exit code of a copy that leaves a message instead of a result
constexpr int kNoMemory = 4;                   // of one that the user's own limit on memory leaves too little
constexpr std::size_t kLongestMessage = 4096;  // which is sent at this length, behind whatever was sent before
constexpr int kClockFactor = 5;                // of a loaded machine

[[noreturn]] void fail(const char* what) {
  const int reason = errno;
  throw IoError(fmt::format("no process can be started: {}: {}", what, std::system_category().message(reason)));
}

/// Address space of this process [bytes].
std::uint64_t own_size() {
  std::ifstream file("/proc/self/statm");
  std::uint64_t pages = 0;
  if (!(file >> pages)) {
    throw IoError("no process can be started: /proc/self/statm cannot be read");
  }
  return pages * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
}

/// returns  whether the user has a lower limit
bool limit(__rlimit_resource_t resource, std::uint64_t most) {
  rlimit now{};
  getrlimit(resource, &now);
  now.rlim_cur = std::min<rlim_t>(now.rlim_max, most);
  if (setrlimit(resource, &now) != 0) {
    _exit(EXIT_FAILURE);
  }
  return now.rlim_cur < most;
}

/// In the copy. Not into a file: the user may have limited those.
void send_whole(int socket, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t count = send(socket, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (count < 0 && errno != EINTR) {
      _exit(EXIT_FAILURE);  // nobody listens any more
    }
    bytes.remove_prefix(static_cast<std::size_t>(std::max<ssize_t>(count, 0)));
  }
}

void work_into(int socket, const std::function<void(const Emit&)>& work) {
  constexpr std::size_t kBlock = std::size_t{1} << 16;
  std::string block;
  work([&](std::string_view piece) {
    block += piece.substr(0, kBlock);
    if (block.size() >= kBlock || piece.size() > kBlock) {
      send_whole(socket, block);
      block.clear();
      send_whole(socket, piece.substr(std::min(piece.size(), kBlock)));
    }
  });
  send_whole(socket, block);
}

/// The life of the copy.
[[noreturn]] void live(int socket, pid_t parent, std::uint64_t size, const std::string& subject,
                       const WorkLimits& limits, const std::function<void(const Emit&)>& work) {
  die_with(parent);
  std::signal(SIGXCPU, SIG_DFL);
  sigset_t time;
  sigemptyset(&time);
  sigaddset(&time, SIGXCPU);
  sigprocmask(SIG_UNBLOCK, &time, nullptr);
  const int nowhere = open("/dev/null", O_WRONLY | O_CLOEXEC);
  dup2(nowhere, STDOUT_FILENO);
  dup2(nowhere, STDERR_FILENO);
  limit(RLIMIT_CORE, 0);
  limit(RLIMIT_CPU, static_cast<std::uint64_t>(limits.seconds));
  const std::uint64_t most = size + limits.memory;
  const bool space = limit(RLIMIT_AS, most);
  const bool users = limit(RLIMIT_DATA, most) || space;
  std::string message = fmt::format("{} needs more than {} MiB of memory", subject, limits.memory >> 20);
  try {
    work_into(socket, work);
    _exit(EXIT_SUCCESS);
  } catch (const std::bad_alloc&) {
    if (users) {
      _exit(kNoMemory);
    }
  } catch (const std::length_error&) {  // sizes that no memory has
  } catch (const std::exception& error) {
    message = error.what();
  }
  message.resize(kLongestMessage);
  send_whole(socket, message);
  _exit(kRefused);
}

/// What the copy sends, in memory that moves as it grows without being copied.
class Received {
 public:
  Received() = default;
  Received(const Received&) = delete;
  Received& operator=(const Received&) = delete;
  ~Received() { std::free(bytes_); }

  std::string_view bytes() const { return {bytes_, size_}; }

  /// Takes what is there; false at the end.
  bool take(int socket) {
    constexpr std::size_t kRoom = std::size_t{1} << 20;
    if (capacity_ - size_ < kRoom) {
      const std::size_t larger = 2 * capacity_ + kRoom;
      void* moved = std::realloc(bytes_, larger);
      if (moved == nullptr) {
        throw std::bad_alloc();
      }
      bytes_ = static_cast<char*>(moved);
      capacity_ = larger;
    }
    const ssize_t count = recv(socket, bytes_ + size_, capacity_ - size_ - 1, 0);
    size_ += static_cast<std::size_t>(std::max<ssize_t>(count, 0));
    bytes_[size_] = '\0';
    return count > 0 || (count < 0 && errno == EINTR);
  }

 private:
  char* bytes_ = nullptr;
  std::size_t size_ = 0;
  std::size_t capacity_ = 0;
};

enum class End { kByItself, kTooLate, kTooLong, kNoMemory };

/// Takes what the copy sends until it has ended, and with it the other end of the socket, or has met a limit.
End receive(int socket, const WorkLimits& limits, Received& received) {
  using Clock = std::chrono::steady_clock;
  const auto last = Clock::now() + std::chrono::seconds(limits.seconds * kClockFactor);
  pollfd waiting{socket, POLLIN, 0};
  while (true) {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(last - Clock::now()).count();
    const int answer = left > 0 ? poll(&waiting, 1, static_cast<int>(left)) : 0;
    if (answer == 0) {
      return End::kTooLate;
    }
    if (answer < 0) {
      continue;  // a signal
    }
    if (received.bytes().size() > limits.output + kLongestMessage) {
      return End::kTooLong;
    }
    try {
      if (!received.take(socket)) {
        return End::kByItself;
      }
    } catch (const std::bad_alloc&) {
      return End::kNoMemory;
    }
  }
}

std::string how_it_ended(int status, bool too_late, int seconds) {
  if (too_late || (WIFSIGNALED(status) && WTERMSIG(status) == SIGXCPU)) {
    return fmt::format("takes more than {} s", seconds);
  }
  return fmt::format("ends {} {}", WIFSIGNALED(status) ? "by" : "with", end_text(status));
}

}  // namespace

WorkOutput isolated(const std::string& subject, const WorkLimits& limits,
                    const std::function<void(const Emit&)>& work) {
  const std::uint64_t size = own_size();
  SocketPair ends;
  const pid_t parent = getpid();
  const pid_t child = fork();
  if (child < 0) {
    fail("fork");
  }
  if (child == 0) {
    live(ends.others.number(), parent, size, subject, limits, work);
  }
  ends.others.close();
  const auto received = std::make_shared<Received>();
  const End end = receive(ends.own.number(), limits, *received);
  if (end != End::kByItself) {
    kill(child, SIGKILL);
  }
  const int status = wait_for(child);
  const int code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  const std::string_view bytes = received->bytes();
  if (end == End::kNoMemory || code == kNoMemory) {
    throw std::bad_alloc();
  }
  if (code == kRefused && bytes.size() >= kLongestMessage) {
    throw InputError(bytes.substr(bytes.size() - kLongestMessage).data());
  }
  if (end == End::kTooLong || (code == EXIT_SUCCESS && bytes.size() > limits.output)) {
    throw InputError(fmt::format("{} gives more than {} MiB", subject, limits.output >> 20));
  }
  require(code == EXIT_SUCCESS, "{} {}", subject, how_it_ended(status, end == End::kTooLate, limits.seconds));
  return {received, bytes};
}

}  // namespace touchfield
