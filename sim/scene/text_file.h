#pragma once

#include <string>

namespace touchfield::schema {

/// The bytes of a file, at most 256 MiB of them.
/// throws   InputError "path: no such file", "path: a directory, must be a file", ...
std::string read_text_file(const std::string& path);

/// Where a text stops being UTF-8 or holds a control character other than tab and end of line.
struct TextFault {
  int line;    // from 1
  int column;  // from 1, in bytes; 0: the text has no fault
};
TextFault find_text_fault(const std::string& text);

}  // namespace touchfield::schema
