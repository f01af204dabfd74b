#pragma once

#include <cstddef>
#include <string>

namespace touchfield::schema {

/// The most that a text for a person to write may have: 10,000 positions with axes, all digits written out, take three
/// quarters of it. The YAML parser takes up to half a second and a quarter of a gigabyte a mebibyte.
inline constexpr std::size_t kMostTextBytes = std::size_t{2} << 20U;

/// Where a text stops being UTF-8 or holds a control character other than tab and end of line.
struct TextFault {
  int line;    // from 1
  int column;  // from 1, in bytes; 0: the text has no fault
};
TextFault find_text_fault(const std::string& text);

}  // namespace touchfield::schema
