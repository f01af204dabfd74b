#include "sim/core/utf8.h"

#include <algorithm>

#include <fmt/format.h>

#include "sim/core/errors.h"

namespace touchfield {

namespace {

/// Length of the character at the start of a text [bytes]; 0 if none that may stand in a text does.
std::size_t character_length(std::string_view text) {
  const auto byte = [&](std::size_t at) { return at < text.size() ? static_cast<unsigned char>(text[at]) : 0U; };
  const unsigned first = byte(0);
  if (first < 0x80) {
    const bool line_end = first == '\n' || (first == '\r' && byte(1) == '\n');
    return (first >= 0x20 && first != 0x7F) || first == '\t' || line_end ? 1 : 0;
  }
  const std::size_t length = first >= 0xC2 && first < 0xE0   ? 2
                             : first >= 0xE0 && first < 0xF0 ? 3
                             : first >= 0xF0 && first < 0xF5 ? 4
                                                             : 0;
  for (std::size_t k = 1; k < length; ++k) {
    if ((byte(k) & 0xC0U) != 0x80U) {
      return 0;
    }
  }
  const bool overlong = (first == 0xE0 && byte(1) < 0xA0) || (first == 0xF0 && byte(1) < 0x90);
  const bool no_character = (first == 0xED && byte(1) >= 0xA0) || (first == 0xF4 && byte(1) >= 0x90);
  return overlong || no_character ? 0 : length;
}

}  // namespace

std::size_t length_of_text(std::string_view bytes) {
  std::size_t at = 0;
  while (const std::size_t length = at < bytes.size() ? character_length(bytes.substr(at)) : 0) {
    at += length;
  }
  return at;
}

void require_text(std::string_view bytes, std::string_view name) {
  const std::size_t length = length_of_text(bytes);
  if (length < bytes.size()) {
    const std::string_view text = bytes.substr(0, length);
    throw InputError(fmt::format("{}:{}:{}: byte 0x{:02x} is not UTF-8 text; save the file as UTF-8", name,
                                 1 + std::ranges::count(text, '\n'), length - (text.rfind('\n') + 1) + 1,
                                 static_cast<unsigned char>(bytes[length])));
  }
}

}  // namespace touchfield
