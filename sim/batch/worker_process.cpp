#include "sim/batch/worker_process.h"

#include <cerrno>
#include <csignal>
#include <cstring>
#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <system_error>
#include <unistd.h>
#include <utility>

#include <fmt/format.h>

#include "sim/core/errors.h"

namespace touchfield {

namespace {

[[noreturn]] void fail(const char* what) {
  throw IoError(fmt::format("a worker process cannot be started: {}: {}", what, std::system_category().message(errno)));
}

/// In the child, between fork and exec: only calls that are safe there.
[[noreturn]] void become(char* const* arguments, int in, int out, int log, pid_t parent) {
  setpgid(0, 0);
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent) {  // it was gone before the line above
    _exit(1);
  }
  sigset_t none;
  sigemptyset(&none);
  sigprocmask(SIG_SETMASK, &none, nullptr);
  dup2(in, STDIN_FILENO);
  dup2(out, STDOUT_FILENO);
  dup2(log, STDERR_FILENO);
  execv(arguments[0], arguments);
  _exit(127);
}

}  // namespace

WorkerProcess::WorkerProcess(const std::vector<std::string>& arguments, const std::string& log) {
  int down[2];
  int up[2];
  if (pipe2(down, O_CLOEXEC) != 0) {
    fail("pipe");
  }
  if (pipe2(up, O_CLOEXEC) != 0) {
    close(down[0]);
    close(down[1]);
    fail("pipe");
  }
  const int errors = open(log.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644);
  std::vector<std::string> words = arguments;
  std::vector<char*> pointers;
  for (std::string& word : words) {
    pointers.push_back(word.data());
  }
  pointers.push_back(nullptr);
  const pid_t parent = getpid();
  pid_ = errors >= 0 ? fork() : -1;
  if (pid_ == 0) {
    become(pointers.data(), down[0], up[1], errors, parent);
  }
  const int error = errno;
  close(down[0]);
  close(up[1]);
  if (errors >= 0) {
    close(errors);
  }
  to_ = down[1];
  from_ = up[0];
  if (pid_ < 0) {
    close(to_);
    close(from_);
    errno = error;
    fail(errors >= 0 ? "fork" : log.c_str());
  }
  fcntl(to_, F_SETFL, O_NONBLOCK);  // of this end alone: the process waits for its jobs
  fcntl(from_, F_SETFL, O_NONBLOCK);
}

WorkerProcess::WorkerProcess(WorkerProcess&& other) noexcept
    : pid_(std::exchange(other.pid_, -1)),
      to_(std::exchange(other.to_, -1)),
      from_(std::exchange(other.from_, -1)),
      unsent_(std::move(other.unsent_)),
      buffer_(std::move(other.buffer_)) {}

WorkerProcess::~WorkerProcess() {
  if (to_ >= 0) {
    close(to_);
  }
  if (from_ >= 0) {
    close(from_);
  }
  if (pid_ > 0) {
    kill();
    waitpid(pid_, nullptr, 0);
  }
}

void WorkerProcess::send(const std::string& line) {
  unsent_ += line + "\n";
  send_rest();
}

void WorkerProcess::send_rest() {
  while (!unsent_.empty()) {
    const ssize_t count = write(to_, unsent_.data(), unsent_.size());
    if (count >= 0) {
      unsent_.erase(0, static_cast<std::size_t>(count));
    } else if (errno == EAGAIN || errno == EWOULDBLOCK) {
      return;
    } else if (errno != EINTR) {
      unsent_.clear();  // it has ended
    }
  }
}

WorkerProcess::Answer WorkerProcess::receive() {
  Answer answer;
  char bytes[4096];
  while (buffer_.find('\n') == std::string::npos) {
    const ssize_t count = read(from_, bytes, sizeof bytes);
    if (count < 0 && errno == EINTR) {
      continue;
    }
    if (count <= 0) {
      answer.ended = count == 0 || (errno != EAGAIN && errno != EWOULDBLOCK);
      return answer;
    }
    buffer_.append(bytes, static_cast<std::size_t>(count));
  }
  const std::size_t end = buffer_.find('\n');
  answer.line = buffer_.substr(0, end);
  buffer_.erase(0, end + 1);
  return answer;
}

std::string WorkerProcess::how_it_ended() {
  int status = 0;
  const pid_t waited = waitpid(pid_, &status, 0);
  pid_ = -1;
  if (waited < 0) {
    return "in an unknown way";
  }
  return WIFSIGNALED(status) ? fmt::format("signal {} ({})", WTERMSIG(status), strsignal(WTERMSIG(status)))
                             : fmt::format("exit code {}", WEXITSTATUS(status));
}

void WorkerProcess::kill() noexcept {
  if (pid_ > 0) {
    ::kill(pid_, SIGKILL);
  }
}

}  // namespace touchfield
