#pragma once

#include <string>

#include "sim/core/child_process.h"

namespace touchfield {

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

  /// Tries once. What is missing is made; a file is never written to.
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

}  // namespace touchfield
