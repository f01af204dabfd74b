#pragma once

#include <cstddef>
#include <string>

namespace touchfield {

/// The bytes of a file, or of a pipe (/dev/stdin, <(command)) until it ends.
///
/// most     of them; a longer file is refused before it is read
/// throws   InputError "path: no such file", "path: a directory, must be a file", likewise of devices and sockets;
///          "path: a pipe, and nothing writes to it" after 2 s; "path: a pipe, and nothing has come for 60 s"; "path:
///          too long, ..."; "path: cannot be read: REASON"
std::string read_whole_file(const std::string& path, std::size_t most);

}  // namespace touchfield
