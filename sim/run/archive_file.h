#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "sim/run/hdf5_file.h"

namespace touchfield {

/// The line that ends a run file: "touchfield-crc32 ", eight hexadecimal digits and a newline. The digits are the
/// CRC-32 (of zlib and PNG) of every byte before the line. HDF5 readers do not look behind a file's own end.
std::string checksum_line(std::string_view bytes);

enum class Checksum {
  kAbsent,  // the file does not end with such a line: cut off, or rewritten by another program
  kCorrect,
  kWrong,
};

/// Hears of a file without its line, which another program has changed.
using Warn = std::function<void(const std::string&)>;

/// Eight hexadecimal digits: the CRC-32 of every byte.
std::string checksum(std::string_view bytes);
/// The same of a file.
/// throws   IoError if it cannot be read
std::string file_checksum(const std::string& path);

/// Length of the line in bytes.
inline constexpr std::size_t kChecksumLength = 26;

// HDF5 files that end with a checksum line: run.h5 and motion.h5.

/// What a file says it is by its attributes format and format_version.
struct ArchiveFormat {
  const char* noun;  // "run"
  int version;       // the one that this program reads and writes

  std::string name() const { return std::string("touchfield-") + noun; }
};

/// Whole or not at all. Groups must be closed.
///
/// throws   IoError naming the path and the system's reason
void write_archive(const std::string& path, const hdf5::MemoryFile& file);

/// The root of a file of this format.
///
/// warn     without it a file without its checksum line is refused
/// throws   InputError if it is missing, is not an HDF5 file, cut, changed, of another format or version, or cannot be
///          read
hdf5::Content read_archive(const std::string& path, const ArchiveFormat& format, const Warn& warn = {});

/// The name of a file's format; empty if it has none. A file without its checksum line has one, too.
///
/// throws   as read_archive where the file cannot be read
std::string archive_format(const std::string& path);

/// Calls a check of what was read; its InputError is then one of damage that names the path.
void require_undamaged(const std::string& path, const std::function<void()>& check);

/// The libraries whose versions change results, files or speed: name and version, as loaded where the library says it,
/// else as compiled against.
std::vector<std::pair<std::string, std::string>> library_versions();

}  // namespace touchfield
