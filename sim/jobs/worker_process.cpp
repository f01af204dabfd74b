#include "sim/jobs/worker_process.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <fcntl.h>
#include <iterator>
#include <sys/socket.h>
#include <system_error>
#include <unistd.h>
#include <utility>

#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/core/program_start.h"

namespace touchfield {

namespace {

[[noreturn]] void fail(const char* what) {
  throw IoError(fmt::format("a worker process cannot be started: {}: {}", what, std::system_category().message(errno)));
}

/// In the child, between fork and exec: only calls that are safe there.
[[noreturn]] void become(char* const* arguments, int socket, int log, pid_t parent) {
  setpgid(0, 0);
  die_with(parent);
  restore_processors();
  sigset_t none;
  sigemptyset(&none);
  sigprocmask(SIG_SETMASK, &none, nullptr);
  dup2(socket, STDIN_FILENO);
  dup2(socket, STDOUT_FILENO);
  dup2(log, STDERR_FILENO);
  execv(arguments[0], arguments);
  _exit(127);
}

}  // namespace

WorkerProcess::WorkerProcess(std::vector<std::string> arguments, const std::string& log) {
  SocketPair ends;
  const Descriptor errors(open(log.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_NOFOLLOW | O_CLOEXEC, 0644));
  if (errors.number() < 0) {
    fail(log.c_str());
  }
  std::vector<char*> pointers;
  std::ranges::transform(arguments, std::back_inserter(pointers), [](std::string& word) { return word.data(); });
  pointers.push_back(nullptr);
  for (const char* name : {"OMP_PROC_BIND", "OMP_PLACES", "GOMP_CPU_AFFINITY"}) {
    unsetenv(name);  // each worker would be bound to the first processors
  }
  const pid_t parent = getpid();
  pid_ = fork();
  if (pid_ < 0) {
    fail("fork");
  }
  if (pid_ == 0) {
    become(pointers.data(), ends.others.number(), errors.number(), parent);
  }
  socket_ = std::move(ends.own);
}

WorkerProcess::~WorkerProcess() {
  if (pid_ > 0) {
    ::kill(pid_, SIGKILL);
    wait_for(pid_);
  }
}

void WorkerProcess::send(const std::string& line) {
  const std::string text = line + "\n";
  ::send(socket_.number(), text.data(), text.size(), MSG_NOSIGNAL);
}

WorkerProcess::Answer WorkerProcess::receive() {
  std::array<char, 4096> bytes;
  const ssize_t count = ::recv(socket_.number(), bytes.data(), bytes.size(), MSG_DONTWAIT);
  if (count <= 0) {
    return {std::nullopt, count == 0 || (errno != EAGAIN && errno != EWOULDBLOCK && errno != EINTR)};
  }
  buffer_.append(bytes.data(), static_cast<std::size_t>(count));
  if (!buffer_.ends_with('\n')) {
    return {};
  }
  buffer_.pop_back();
  return {std::exchange(buffer_, {})};
}

std::string WorkerProcess::how_it_ended() { return end_text(wait_for(std::exchange(pid_, -1))); }

}  // namespace touchfield
