#pragma once

#include <initializer_list>
#include <optional>
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

/// Writes the parts one after another as one file, which appears under `path` whole or not at all. The parts go to a
/// temporary file in the same directory, which is flushed to the disk and renamed. Nobody can guess its name
/// (.NAME.tmp- and 16 hexadecimal digits). An older file is replaced; on failure it stays as it was and nothing else is
/// left behind.
///
/// throws   NoRoomError if there is no room, IoError on anything else, naming the path and the system's reason
void write_atomically(const std::string& path, std::initializer_list<std::string_view> parts);

/// The file that this is the temporary name of: what a process leaves that is killed while it writes.
std::optional<std::string> target_of_temporary(std::string_view name);

}  // namespace touchfield
