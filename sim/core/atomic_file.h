#pragma once

#include <initializer_list>
#include <string>
#include <string_view>

#include "sim/core/errors.h"

namespace touchfield {

/// A file for which there is no room: a full disk, a used-up quota, a limit on the size of files. Nothing is wrong with
/// what was to be written; with room it can be.
class NoRoomError : public IoError {
 public:
  using IoError::IoError;
};

/// Writes the parts one after another as one file. It appears under `path` whole or not at all: a temporary name in the
/// same directory that nobody can guess (.NAME.tmp- and 16 hexadecimal digits), flush to the disk, rename. An older
/// file is replaced; on failure it stays as it was and nothing else is left behind.
///
/// throws   NoRoomError if there is no room, IoError on anything else, naming the path and the system's reason
void write_atomically(const std::string& path, std::initializer_list<std::string_view> parts);

/// True if `name` is the temporary name of a file called `target`: what a process leaves that is killed while it
/// writes.
bool is_leftover(std::string_view name, std::string_view target);

}  // namespace touchfield
