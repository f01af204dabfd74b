#pragma once

#include <functional>
#include <string>

#include "sim/run/checksum.h"
#include "sim/run/hdf5_file.h"

/// HDF5 files that end with a checksum line: run.h5 and motion.h5.
namespace touchfield {

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

}  // namespace touchfield
