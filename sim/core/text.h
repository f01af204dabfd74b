#pragma once

#include <charconv>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "sim/core/types.h"

namespace touchfield {

/// The number that the whole of a text spells, independent of the locale: "12", "-1.5e3", for floating point "inf" and
/// "nan" too; no leading + and no blanks. Nothing if it spells none, or one that Number cannot hold.
template <class Number>
std::optional<Number> number_of(std::string_view text) {
  Number value{};
  const char* end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, value);
  return error == std::errc() && stop == end ? std::optional(value) : std::nullopt;
}

/// A line without its comment, which begins with #. The # of 1.#QNAN, how an old C library spells NaN, begins none:
/// what is before it would pass for a number.
inline std::string_view without_comment(std::string_view line) {
  std::size_t at = line.find('#');
  while (at != std::string_view::npos && at > 0 && line[at - 1] == '.') {
    at = line.find('#', at + 1);
  }
  return line.substr(0, at);
}

/// The bytes before the first one that is not text [bytes]; the size of the text if there is none. Text is UTF-8
/// without control characters other than tab and ends of lines, which are a line feed or a carriage return before one.
std::size_t length_of_text(std::string_view bytes);

/// name     what messages call the text
/// throws   InputError "name:line:column: byte 0xff is not UTF-8 text, ..."; the column counts bytes from 1
void require_text(std::string_view bytes, std::string_view name);

/// A point [m] for a message: "(1.2, -3.4, 200.0) mm".
///
/// decimals   of a millimetre
std::string place_text(const Vector3& point, int decimals = 1);

/// FNV-1a, 64 bit, as "fnv1a64:" and 16 hexadecimal digits: tells texts apart, guards against nothing.
std::string text_hash(std::string_view text);

/// "1 face", "2 faces".
inline std::string counted(std::int64_t count, const std::string& one, const std::string& many) {
  return std::to_string(count) + " " + (count == 1 ? one : many);
}

}  // namespace touchfield
