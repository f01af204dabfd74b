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

/// What some programs put before a text of UTF-8.
inline constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";

/// Calls `visit` with the lines of a text, without their ends, and their numbers from 1. A line ends with a line feed,
/// a carriage return or both.
template <class Visit>
void for_each_text_line(std::string_view text, const Visit& visit) {
  for (int number = 1; !text.empty(); ++number) {
    const std::size_t end = std::min(text.find_first_of("\r\n"), text.size());
    visit(number, text.substr(0, end));
    text.remove_prefix(std::min(end + (text.substr(end).starts_with("\r\n") ? 2 : 1), text.size()));
  }
}

/// A text without the blanks at its ends.
std::string_view trimmed(std::string_view text);

/// Parts between commas and blanks, any number of them.
std::vector<std::string_view> words(std::string_view line, std::string_view between = ", \t");

/// Parts between single commas, or another separator; between blanks it is any number of them.
std::vector<std::string_view> cells(std::string_view line, char separator = ',');

/// Where a text stops being UTF-8 or holds a control character other than tab and end of line.
struct TextFault {
  int line;                // from 1
  int column;              // from 1, in bytes; 0: the text has no fault
  unsigned char byte = 0;  // there
};
TextFault find_text_fault(const std::string& text);

/// What of a line looks like a blank, a sign or a quote but is another character, as word processors and web pages make
/// them, before the line's comment. Empty if there is nothing.
///
/// returns   e.g. "no-break space (U+00A0) at column 1, write a plain space"; the first alone, columns in bytes from 1
std::string odd_character(std::string_view line);

}  // namespace touchfield::schema
