#pragma once

#include <cstddef>
#include <string>

namespace touchfield {

/// The bytes of a file, or of a pipe (/dev/stdin, <(command)) until it ends.
///
/// most     of them; a longer file is refused before it is read whole
/// throws   InputError "path: no such file", "path: a directory, must be a file", "path: too long, ..." or
///          "path: cannot be read: REASON"
std::string read_whole_file(const std::string& path, std::size_t most);

/// The same of a text, without a byte order mark of UTF-8.
/// throws   InputError also as require_text (utf8.h)
std::string read_text_file(const std::string& path, std::size_t most);

}  // namespace touchfield
