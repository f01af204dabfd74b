#pragma once

#include <functional>
#include <string>

#include "sim/store/hdf5_content.h"
#include "sim/store/hdf5_file.h"

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
/// throws   InputError if it is missing, no HDF5, cut, changed, of another format or version, or cannot be read;
///          IoError if no process can be started to read it in
hdf5::Content read_archive(const std::string& path, const ArchiveFormat& format);

/// The name of a file's format; empty if it has none.
///
/// throws   as read_archive where the file cannot be read
std::string archive_format(const std::string& path);

/// Calls a check of what was read; its InputError is then one of damage that names the path.
void require_undamaged(const std::string& path, const std::function<void()>& check);

}  // namespace touchfield
