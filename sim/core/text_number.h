#pragma once

#include <charconv>
#include <cstddef>
#include <optional>
#include <string_view>

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

}  // namespace touchfield
