#pragma once

#include <cstddef>
#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>

#include "sim/core/child_process.h"
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
/// (.NAME.tmp- and 16 hexadecimal digits). An older file is replaced, but no link, folder, pipe or device. On failure
/// all stays as it was and nothing else is left behind.
///
/// throws   NoRoomError if there is no room, IoError on anything else, naming the path and the system's reason
void write_atomically(const std::string& path, std::initializer_list<std::string_view> parts);

/// Asks early whether write_atomically may write a file of this name.
/// force    whether an older file may be replaced
/// remedy   what a user can do where it may not: "give another with -o, or --force to replace it"
/// throws   InputError where there is an older file without `force`, or a link, folder, pipe or device
void require_free(const std::string& path, bool force, const std::string& remedy);

/// The file that this is the temporary name of: what a process leaves that is killed while it writes.
std::optional<std::string> target_of_temporary(std::string_view name);

/// The bytes of a file, or of a pipe (/dev/stdin, <(command)) until it ends.
///
/// most     of them; a longer file is refused before it is read whole
/// throws   InputError "path: no such file", "path: a directory, must be a file", "path: too long, ..." or
///          "path: cannot be read: REASON"
std::string read_whole_file(const std::string& path, std::size_t most);

/// The same of a text, without a byte order mark of UTF-8.
/// throws   InputError also as require_text (text.h)
std::string read_text_file(const std::string& path, std::size_t most);

/// A lock (flock) on a file or a folder: of one process at a time, until the object or the process ends, however that
/// ends. Processes that are started do not inherit it; copies of this one (fork) lose it with the object. A network
/// file system may lock files between machines, and folders on each machine alone.
class FileLock {
 public:
  enum class State {
    kHeld,
    kElsewhere,  // another process, or another object of this one, holds it
    kUnknown,    // this file system has no locks (ENOLCK, ENOSYS): nobody holds any
  };

  /// Tries once. What is missing is made; a file is never written to, nor one that a link leads to.
  /// throws   IoError with the system's reason if it can be neither made nor opened
  static FileLock of_file(const std::string& path) { return {path, false}; }
  static FileLock of_folder(const std::string& path) { return {path, true}; }

  FileLock(FileLock&&) noexcept = default;
  FileLock& operator=(FileLock&&) noexcept = default;
  FileLock(const FileLock&) = delete;
  FileLock& operator=(const FileLock&) = delete;
  ~FileLock();

  State state() const { return state_; }

 private:
  FileLock(const std::string& path, bool is_folder);

  Descriptor file_;
  State state_ = State::kElsewhere;
};

/// A log: lines, each with the time it was written, in the file at once.
class LogFile {
 public:
  /// Makes the file; nothing of that name, be it a link, is written to.
  /// throws   IoError if it cannot be made
  explicit LogFile(const std::string& path);

  /// What finds no room is left out: a log is no part of a result.
  void line(std::string_view text);

 private:
  Descriptor file_;
};

}  // namespace touchfield
