#pragma once

#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <sys/time.h>
#include <unistd.h>

#include "sim/core/errors.h"

/// What the fuzz targets share. A target gives an input to a reader: an error made for users is an answer, any other
/// exception, a report of a sanitizer, a hang or a promise that does not hold is a finding.
namespace touchfield::fuzz {

inline std::string text_of(const std::uint8_t* data, std::size_t size) { return {data, data + size}; }

/// Ends the process, for libFuzzer to keep the input, unless the promise holds.
inline void require(bool holds, const char* promise) {
  if (!holds) {
    std::fprintf(stderr, "broken promise: %s\n", promise);
    std::abort();
  }
}

/// Ends the process, for libFuzzer to keep the input, if it lives for 2 s of processor time: libFuzzer's own limit is
/// by the clock, which runs on while a loaded machine does other things.
class TimeLimit {
 public:
  TimeLimit() {
    std::signal(SIGPROF, [](int) {
      constexpr char kMessage[] = "broken promise: an input takes less than 2 s\n";
      [[maybe_unused]] const auto written = ::write(STDERR_FILENO, kMessage, sizeof kMessage - 1);
      std::abort();
    });
    set(2);
  }
  TimeLimit(const TimeLimit&) = delete;
  TimeLimit& operator=(const TimeLimit&) = delete;
  ~TimeLimit() { set(0); }

 private:
  static void set(int seconds) {
    const itimerval timer{{0, 0}, {seconds, 0}};
    ::setitimer(ITIMER_PROF, &timer, nullptr);
  }
};

/// False if the reader refuses its input.
template <class Refusal = InputError, class Read>
bool accepts(const Read& read) {
  try {
    read();
    return true;
  } catch (const Refusal& error) {
    require(*error.what() != '\0', "a refusal says why");
    return false;
  }
}

/// A file of this process in the temporary directory, written anew.
inline std::string file_with(const std::string& name, const std::string& content) {
  static const std::filesystem::path folder = [] {
    std::filesystem::path own =
        std::filesystem::temp_directory_path() / ("touchfield-fuzz-" + std::to_string(::getpid()));
    std::filesystem::create_directories(own);
    return own;
  }();
  const std::string path = folder / name;
  std::ofstream(path, std::ios::binary) << content;
  return path;
}

}  // namespace touchfield::fuzz
