#pragma once

#include <initializer_list>
#include <string>
#include <string_view>

namespace touchfield {

/// Writes the parts one after another as one file. It appears under `path` whole or not at all: a temporary name in the
/// same directory (.NAME.tmp-PID), flush to the disk, rename. An older file is replaced; on failure it stays as it was
/// and nothing else is left behind.
///
/// throws   IoError naming the path and the system's reason
void write_atomically(const std::string& path, std::initializer_list<std::string_view> parts);

}  // namespace touchfield
