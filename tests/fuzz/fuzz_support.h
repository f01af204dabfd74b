#pragma once

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
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
