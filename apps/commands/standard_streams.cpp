#include "apps/commands/standard_streams.h"

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <fcntl.h>
#include <unistd.h>

#include <fmt/format.h>

namespace touchfield {

namespace {

void print(std::FILE* stream, std::string_view text) {
  if (!text.empty()) {
    std::fwrite(text.data(), 1, text.size(), stream);  // a failure stays with the stream
  }
}

}  // namespace

void hold_standard_streams() {
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGXFSZ, SIG_IGN);
  for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (fcntl(stream, F_GETFD) < 0) {
      // Opened the wrong way round, so that using it fails as before. The lowest free number is this one.
      static_cast<void>(open("/dev/null", stream == STDIN_FILENO ? O_WRONLY : O_RDONLY));
    }
  }
}

void put(std::string_view text) { print(stdout, text); }

void say(std::string_view text) { print(stderr, text); }

void say_warning(const std::string& text) { say("touchfield: warning: " + text + '\n'); }

void clear_line() { print(stderr, "\r\033[K"); }

int finish_output(int code) {
  errno = 0;
  const bool flushed = std::fflush(stdout) == 0;
  const std::string reason = flushed ? "" : ": " + std::system_category().message(errno);
  const bool out = flushed && std::ferror(stdout) == 0;
  const bool err = std::ferror(stderr) == 0;
  if (!out) {
    say(fmt::format("touchfield: error: standard output could not be written completely{}\n", reason));
  }
  if (!err) {
    put("touchfield: error: standard error could not be written completely\n");
    std::fflush(stdout);
  }
  return code == 0 && !(out && err) ? 1 : code;
}

}  // namespace touchfield
