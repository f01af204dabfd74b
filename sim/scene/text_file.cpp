#include "sim/scene/text_file.h"

#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <memory>
#include <system_error>

#include <fmt/format.h>

#include "sim/core/errors.h"

namespace touchfield::schema {

namespace {

// Length of the UTF-8 character at i, 0 if there is none (overlong forms and surrogates are none).
std::size_t character_length(const std::string& text, std::size_t i) {
  const auto byte = [&](std::size_t at) { return at < text.size() ? static_cast<unsigned char>(text[at]) : 0U; };
  const unsigned first = byte(i);
  if (first < 0x80) {
    return 1;
  }
  const std::size_t length = first >= 0xC2 && first < 0xE0   ? 2
                             : first >= 0xE0 && first < 0xF0 ? 3
                             : first >= 0xF0 && first < 0xF5 ? 4
                                                             : 0;
  for (std::size_t k = 1; k < length; ++k) {
    if ((byte(i + k) & 0xC0U) != 0x80U) {
      return 0;
    }
  }
  const unsigned second = byte(i + 1);
  const bool overlong = (first == 0xE0 && second < 0xA0) || (first == 0xF0 && second < 0x90);
  const bool no_character = (first == 0xED && second >= 0xA0) || (first == 0xF4 && second >= 0x90);
  return overlong || no_character ? 0 : length;
}

[[noreturn]] void refuse_length(const std::string& path, std::uintmax_t most) {
  throw InputError(fmt::format("{}: too long, must be at most {} bytes", path, most));
}

}  // namespace

std::string read_text_file(const std::string& path, std::size_t most) {
  std::error_code error;
  const auto status = std::filesystem::status(path, error);
  if (status.type() == std::filesystem::file_type::not_found) {
    throw InputError(path + ": no such file");
  }
  if (std::filesystem::is_directory(status)) {
    throw InputError(path + ": a directory, must be a file");
  }
  if (std::filesystem::is_regular_file(status) && std::filesystem::file_size(path, error) > most && !error) {
    refuse_length(path, most);
  }

  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> stream(std::fopen(path.c_str(), "rb"), &std::fclose);
  if (!stream) {
    throw InputError(fmt::format("{}: cannot be read: {}", path, std::strerror(errno)));
  }
  std::string text;
  constexpr std::size_t kBlock = 1U << 16U;
  for (std::size_t got = kBlock; got == kBlock;) {
    const std::size_t size = text.size();
    if (size > most) {
      refuse_length(path, most);
    }
    text.resize(size + kBlock);
    got = std::fread(text.data() + size, 1, kBlock, stream.get());
    text.resize(size + got);
  }
  if (std::ferror(stream.get()) != 0) {
    throw InputError(fmt::format("{}: cannot be read: {}", path, std::strerror(errno)));
  }
  return text;
}

TextFault find_text_fault(const std::string& text) {
  int line = 1;
  std::size_t line_start = 0;
  for (std::size_t i = 0; i < text.size();) {
    const auto byte = static_cast<unsigned char>(text[i]);
    const std::size_t length = character_length(text, i);
    const bool control = (byte < 0x20 && byte != '\t' && byte != '\n' && byte != '\r') || byte == 0x7F;
    if (length == 0 || control) {
      return {line, static_cast<int>(i - line_start) + 1};
    }
    i += length;
    if (byte == '\n') {
      ++line;
      line_start = i;
    }
  }
  return {line, 0};
}

}  // namespace touchfield::schema
