#pragma once

#include <string>

#include "sim/run/archive_file.h"
#include "sim/run/motion_data.h"

namespace touchfield {

/// Version of the layout of motion.h5; docs/motion-file.md describes it.
inline constexpr int kMotionFormatVersion = 5;

inline constexpr ArchiveFormat kMotionArchive = {"motion", kMotionFormatVersion};

/// The result file of a directory: run.h5, else motion.h5 or pattern.h5 where one is there; another path as it is.
std::string result_file_at(const std::string& path);

/// Writes a motion as HDF5. The file appears under `path` whole or not at all (temporary name, flush, rename); an older
/// one is replaced.
///
/// throws   IoError naming the path and the system's reason; InputError if parts of the motion do not fit each other or
///          a name of a method or stage is not made of letters, digits, _ and -
void write_motion_file(const std::string& path, const Motion& motion);

/// Reads a motion back, as much of it as the file holds.
///
/// warn     as of read_archive
/// throws   InputError if the file is missing, is not a motion of touchfield, of a newer format version, damaged, or
///          cannot be read
Motion read_motion_file(const std::string& path, const Warn& warn = {});

/// throws   InputError naming the first part of the motion whose size does not fit the rest, and any name of a method
///          or stage that cannot be stored
void check_motion(const Motion& motion);

/// The same for an instant by itself.
void check_instant(const MotionInstant& instant);

}  // namespace touchfield
