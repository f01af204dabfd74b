#include "sim/core/text.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/core/units.h"

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

std::string place_text(const Vector3& point, int decimals) {
  const double parts = std::pow(10.0, decimals);
  const Vector3 mm = (parts / kMillimetre * point).array().round() / parts + 0.0;  // no -0.0
  return fmt::format("({:.{}f}, {:.{}f}, {:.{}f}) mm", mm.x(), decimals, mm.y(), decimals, mm.z(), decimals);
}

std::string text_hash(std::string_view text) {
  std::uint64_t hash = 0xcbf29ce484222325U;
  for (const char c : text) {
    hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3U;
  }
  return fmt::format("fnv1a64:{:016x}", hash);
}

}  // namespace touchfield
