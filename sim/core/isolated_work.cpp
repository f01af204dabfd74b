#include "sim/core/isolated_work.h"

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <fcntl.h>
#include <fstream>
#include <new>
#include <poll.h>
#include <stdexcept>
#include <string>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <system_error>
#include <unistd.h>

#include <fmt/format.h>

#include "sim/core/child_process.h"
#include "sim/core/errors.h"

namespace touchfield {

namespace {

constexpr int kRefused = 2;  // exit code of a copy that leaves a message instead of a result
constexpr std::size_t kLongestMessage = 4096;
constexpr int kClockFactor = 5;  // of a loaded machine

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

void limit(__rlimit_resource_t resource, std::uint64_t most) {
  rlimit now{};
  getrlimit(resource, &now);
  now.rlim_cur = std::min<rlim_t>(now.rlim_max, most);
  if (setrlimit(resource, &now) != 0) {
    _exit(EXIT_FAILURE);
  }
}

/// Throws what write() says; the limit of the output comes as EFBIG.
void write_whole(int file, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t count = write(file, bytes.data(), bytes.size());
    if (count < 0 && errno != EINTR) {
      throw std::system_error(errno, std::system_category());
    }
    bytes.remove_prefix(static_cast<std::size_t>(std::max<ssize_t>(count, 0)));
  }
}

void work_into(int file, const std::function<void(const Emit&)>& work) {
  constexpr std::size_t kBlock = std::size_t{1} << 16;
  std::string block;
  work([&](std::string_view piece) {
    block += piece.substr(0, kBlock);
    if (block.size() >= kBlock || piece.size() > kBlock) {
      write_whole(file, block);
      block.clear();
      write_whole(file, piece.substr(std::min(piece.size(), kBlock)));
    }
  });
  write_whole(file, block);
}

/// The life of the copy.
[[noreturn]] void live(int file, pid_t parent, std::uint64_t size, const std::string& subject, const WorkLimits& limits,
                       const std::function<void(const Emit&)>& work) {
  die_with(parent);
  std::signal(SIGXFSZ, SIG_IGN);
  std::signal(SIGXCPU, SIG_DFL);
  const int nowhere = open("/dev/null", O_WRONLY | O_CLOEXEC);
  dup2(nowhere, STDOUT_FILENO);
  dup2(nowhere, STDERR_FILENO);
  limit(RLIMIT_CORE, 0);
  limit(RLIMIT_CPU, static_cast<std::uint64_t>(limits.seconds));
  limit(RLIMIT_FSIZE, limits.output);
  limit(RLIMIT_AS, size + limits.memory);
  std::string message;
  try {
    work_into(file, work);
    _exit(EXIT_SUCCESS);
  } catch (const std::bad_alloc&) {
    message = fmt::format("{} needs more than {} MiB of memory", subject, limits.memory >> 20);
  } catch (const std::length_error&) {
    message = fmt::format("{} needs more than {} MiB of memory", subject, limits.memory >> 20);
  } catch (const std::system_error& error) {
    message = error.code().value() == EFBIG ? fmt::format("{} gives more than {} MiB", subject, limits.output >> 20)
                                            : fmt::format("{} fails: {}", subject, error.what());
  } catch (const std::exception& error) {
    message = error.what();
  }
  message.resize(std::min(message.size(), kLongestMessage));
  if (ftruncate(file, 0) != 0 || pwrite(file, message.data(), message.size(), 0) < 0) {
    _exit(EXIT_FAILURE);
  }
  _exit(kRefused);
}

/// Waits until the copy has ended and with it the other end of the socket. Kills one that takes too long: false.
bool ends_in_time(pid_t child, int socket, int seconds) {
  pollfd waiting{socket, POLLIN, 0};
  int answer = 0;
  do {
    answer = poll(&waiting, 1, 1000 * seconds * kClockFactor);
  } while (answer < 0 && errno == EINTR);
  if (answer == 0) {
    kill(child, SIGKILL);
  }
  return answer != 0;
}

std::string how_it_ended(int status, bool in_time, int seconds) {
  if (!in_time || (WIFSIGNALED(status) && WTERMSIG(status) == SIGXCPU)) {
    return fmt::format("takes more than {} s", seconds);
  }
  return fmt::format("ends {} {}", WIFSIGNALED(status) ? "by" : "with", end_text(status));
}

WorkOutput contents(int file) {
  struct stat about {};
  if (fstat(file, &about) != 0) {
    fail("fstat");
  }
  const auto size = static_cast<std::size_t>(about.st_size);
  if (size == 0) {
    return {};
  }
  void* mapped = mmap(nullptr, size, PROT_READ, MAP_PRIVATE, file, 0);
  if (mapped == MAP_FAILED) {
    fail("mmap");
  }
  return {std::shared_ptr<const void>(mapped, [size](const void* begin) { munmap(const_cast<void*>(begin), size); }),
          {static_cast<const char*>(mapped), size}};
}

}  // namespace

WorkOutput isolated(const std::string& subject, const WorkLimits& limits,
                    const std::function<void(const Emit&)>& work) {
  const std::uint64_t size = own_size();
  const Descriptor file(memfd_create("touchfield", MFD_CLOEXEC));
  if (file.number() < 0) {
    fail("memfd_create");
  }
  SocketPair ends;
  const pid_t parent = getpid();
  const pid_t child = fork();
  if (child < 0) {
    fail("fork");
  }
  if (child == 0) {
    live(file.number(), parent, size, subject, limits, work);
  }
  ends.others.close();
  const bool in_time = ends_in_time(child, ends.own.number(), limits.seconds);
  const int status = wait_for(child);
  const int code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  if (code == EXIT_SUCCESS) {
    return contents(file.number());
  }
  if (code == kRefused) {
    const WorkOutput message = contents(file.number());
    throw InputError(std::string(message.bytes.substr(0, kLongestMessage)));
  }
  throw InputError(fmt::format("{} {}", subject, how_it_ended(status, in_time, limits.seconds)));
}

}  // namespace touchfield
