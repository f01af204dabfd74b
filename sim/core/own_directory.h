#pragma once

#include <functional>
#include <string>

#include "sim/core/child_process.h"

namespace touchfield {

/// A directory in which this process alone works while the object lives, or with others that share it. This is by the
/// kernel's lock (flock) on the directory itself. The lock needs no file, and ends with the process, however that ends.
/// Processes that are started do not inherit it; copies of this one (fork) lose it with the object.
class OwnDirectory {
 public:
  /// path       of the directory, or of a link to it
  /// lock_file  of this name in the directory, made if need be, and locked as well: network file systems may lock files
  ///            between machines, and directories on each machine alone. Never written to. Empty: none
  /// shared     others that share it may work in it too
  /// throws     InputError if another process works in it, or if it cannot be opened or locked
  explicit OwnDirectory(std::string path, const std::string& lock_file = {}, bool shared = false);
  OwnDirectory(OwnDirectory&&) noexcept = default;
  OwnDirectory& operator=(OwnDirectory&&) = delete;
  OwnDirectory(const OwnDirectory&) = delete;
  OwnDirectory& operator=(const OwnDirectory&) = delete;
  ~OwnDirectory();

  const std::string& path() const { return path_; }

  /// Removes a file of the directory or of a folder of it; a link is removed itself, a folder stays. A folder that is a
  /// link is not entered: nothing outside of the directory is ever removed.
  /// name     NAME or FOLDER/NAME
  /// throws   InputError with the system's reason; nothing if there is no such file
  void remove(const std::string& name) const;

  /// remove_leftovers (atomic_file.h) in the directory itself (folder: "") or in a folder of it.
  void remove_leftovers(const std::string& folder, const std::function<bool(const std::string&)>& is_own,
                        bool even_living = false) const;

  /// throws   InputError if something of this name is there and is no folder of the directory itself: a link would lead
  ///          what is written elsewhere
  void require_own_folder(const std::string& name) const;

 private:
  Descriptor folder(const std::string& name) const;

  std::string path_;
  Descriptor directory_;
  Descriptor lock_file_;
};

}  // namespace touchfield
