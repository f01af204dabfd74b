#include "sim/core/json_text.h"

#include <algorithm>
#include <charconv>
#include <optional>

#include <fmt/format.h>

#include "sim/core/require.h"
#include "sim/core/utf8.h"

namespace touchfield {

namespace {

constexpr int kDeepest = 64;  // of arrays and objects in one another

std::string stand_in(unsigned byte) {
  return {'\xF4', '\x8F', static_cast<char>(0xBCU + (byte >> 6U)), static_cast<char>(0x80U | (byte & 0x3FU))};
}

/// The byte that the character at a place stands for; nothing if it is another character.
std::optional<unsigned> stands_for(std::string_view text, std::size_t place) {
  if (!text.substr(place).starts_with("\xF4\x8F") || character_length(text, place) != 4) {
    return std::nullopt;
  }
  const unsigned third = static_cast<unsigned char>(text[place + 2]);
  const unsigned fourth = static_cast<unsigned char>(text[place + 3]);
  return third >= 0xBE ? std::optional(((third - 0xBCU) << 6U) | (fourth & 0x3FU)) : std::nullopt;
}

/// The number XXXX of \uXXXX at a place of a JSON text; -1 if there is no such thing.
int escaped_at(std::string_view text, std::size_t place) {
  if (place + 6 > text.size() || text[place] != '\\' || text[place + 1] != 'u') {
    return -1;
  }
  int value = -1;
  const char* const end = text.data() + place + 6;
  return std::from_chars(text.data() + place + 2, end, value, 16).ptr == end ? value : -1;
}

}  // namespace

std::string bytes_in_characters(const std::string& bytes) {
  std::string text;
  for (std::size_t i = 0; i < bytes.size();) {
    const std::size_t length = stands_for(bytes, i) ? 0 : character_length(bytes, i);
    text += length == 0 ? stand_in(static_cast<unsigned char>(bytes[i])) : bytes.substr(i, length);
    i += std::max<std::size_t>(length, 1);
  }
  return text;
}

std::string characters_in_bytes(const std::string& text) {
  std::string bytes;
  for (std::size_t i = 0; i < text.size();) {
    const auto byte = stands_for(text, i);
    bytes += byte ? static_cast<char>(*byte) : text[i];
    i += byte ? 4 : 1;
  }
  return bytes;
}

std::string with_escaped_bytes(const std::string& json) {
  std::string text;
  text.reserve(json.size());
  for (std::size_t i = 0; i < json.size();) {
    if (const auto byte = stands_for(json, i)) {
      text += fmt::format("\\udc{:02x}", *byte);
      i += 4;
    } else {
      text += json[i++];
    }
  }
  return text;
}

std::string with_stand_ins(std::string_view text) {
  std::string characters;
  bool quoted = false;
  int depth = 0;
  for (std::size_t i = 0; i < text.size();) {
    const char c = text[i];
    quoted = quoted != (c == '"');
    depth += quoted ? 0 : c == '[' || c == '{' ? 1 : c == ']' || c == '}' ? -1 : 0;
    require(depth <= kDeepest, "JSON of more than {} levels", kDeepest);
    const int code = escaped_at(text, i);
    const bool pair = code >= 0xD800 && code < 0xDC00 && escaped_at(text, i + 6) >= 0;
    const std::size_t length = pair ? 12 : code >= 0 ? 6 : c == '\\' ? 2 : 1;
    characters += code >= 0xDC80 && code <= 0xDCFF ? stand_in(static_cast<unsigned>(code) & 0xFFU)
                                                   : std::string(text.substr(i, length));
    i += length;
  }
  return characters;
}

}  // namespace touchfield
