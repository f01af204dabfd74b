#pragma once

#include <algorithm>
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace touchfield::schema {

/// The most that a text for a person to write may have: 10,000 positions with axes, all digits written out, take three
/// quarters of it. The YAML parser takes up to half a second and a quarter of a gigabyte a mebibyte.
inline constexpr std::size_t kMostTextBytes = std::size_t{2} << 20U;

/// Calls `visit` with the lines of a text, without their ends, and their numbers from 1.
template <class Visit>
void for_each_text_line(std::string_view text, const Visit& visit) {
  for (int number = 1; !text.empty(); ++number) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    const std::string_view line = text.substr(0, end);
    visit(number, line.substr(0, line.size() - (line.ends_with('\r') ? 1 : 0)));
    text.remove_prefix(std::min(end + 1, text.size()));
  }
}

/// A text without the blanks at its ends.
std::string_view trimmed(std::string_view text);

/// Parts between commas and blanks, any number of them.
std::vector<std::string_view> words(std::string_view line, std::string_view between = ", \t");

/// Parts between single commas, or another separator; between blanks it is any number of them.
std::vector<std::string_view> cells(std::string_view line, char separator = ',');

}  // namespace touchfield::schema
