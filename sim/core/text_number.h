#pragma once

#include <charconv>
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

}  // namespace touchfield
