#include "sim/core/utf8.h"

#include <algorithm>

#include <fmt/format.h>

namespace touchfield {

namespace {

unsigned byte_at(std::string_view text, std::size_t place) {
  return place < text.size() ? static_cast<unsigned char>(text[place]) : 0U;
}

/// The character of up to three bytes at a place; 0 for a longer one.
unsigned code_point(std::string_view text, std::size_t place, std::size_t length) {
  const unsigned first = byte_at(text, place);
  const auto low = [&](std::size_t k) { return byte_at(text, place + k) & 0x3FU; };
  return length == 1   ? first
         : length == 2 ? ((first & 0x1FU) << 6U) | low(1)
         : length == 3 ? ((first & 0x0FU) << 12U) | (low(1) << 6U) | low(2)
                       : 0U;
}

bool controls_a_terminal(unsigned code) {
  return code < 0x20 || (code >= 0x7F && code < 0xA0) || (code >= 0x202A && code <= 0x202E) ||
         (code >= 0x2066 && code <= 0x2069);
}

std::string shown(std::string_view text, std::string_view kept) {
  std::string result;
  result.reserve(text.size());
  for (std::size_t i = 0; i < text.size();) {
    const std::size_t length = character_length(text, i);
    const unsigned code = code_point(text, i, length);
    const std::string_view character = text.substr(i, std::max<std::size_t>(length, 1));
    if ((length == 1 || length == 2 || length == 3) && controls_a_terminal(code) &&
        kept.find(character) == std::string_view::npos) {
      result += fmt::format("\\u{:04x}", code);
    } else {
      result += character;
    }
    i += character.size();
  }
  return result;
}

}  // namespace

std::size_t character_length(std::string_view text, std::size_t place) {
  const unsigned first = byte_at(text, place);
  if (first < 0x80) {
    return 1;
  }
  const std::size_t length = first >= 0xC2 && first < 0xE0   ? 2
                             : first >= 0xE0 && first < 0xF0 ? 3
                             : first >= 0xF0 && first < 0xF5 ? 4
                                                             : 0;
  for (std::size_t k = 1; k < length; ++k) {
    if ((byte_at(text, place + k) & 0xC0U) != 0x80U) {
      return 0;
    }
  }
  const unsigned second = byte_at(text, place + 1);
  const bool overlong = (first == 0xE0 && second < 0xA0) || (first == 0xF0 && second < 0x90);
  const bool no_character = (first == 0xED && second >= 0xA0) || (first == 0xF4 && second >= 0x90);
  return overlong || no_character ? 0 : length;
}

std::string visible_text(std::string_view text) { return shown(text, "\t\n"); }

std::string one_line(std::string_view text) { return shown(text, ""); }

}  // namespace touchfield
