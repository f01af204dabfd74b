#pragma once

#include <filesystem>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "sim/core/own_directory.h"

namespace touchfield {

/// The names of a directory's files that are a run's or a study's own, its manifest among them; nothing if it holds
/// neither. A run that is older than manifests owns the names that every run had, and those of `files`.
std::optional<std::vector<std::string>> own_files(const std::string& directory, const std::vector<std::string>& files);

/// Whether there is something of a name, be it a link that leads nowhere.
bool there(const std::filesystem::path& file);

/// Makes a directory for results, and those above it.
/// throws   InputError if it cannot be made, or a file is in the way
void make_directory(const std::string& path);

/// The directory that holds a run, and the record of its contents. It is claimed before anything is computed, and until
/// the end of this object. Its manifest, files.json, names the files that the run writes, in the directory or a folder
/// of it. No other file is ever replaced or removed, and nothing outside of the directory. Half-written files of a
/// process that was killed are removed at the next start. Safe to call from several threads: an interrupt is handled
/// beside the run.
class RunDirectory {
 public:
  /// The next free ROOT/NAME-NNNN, made here. Two runs that start at once get two numbers.
  /// files    names of all that is going to be written; if empty, there is no manifest
  /// throws   InputError if it cannot be made or written to, naming the path and the system's reason
  static RunDirectory next_free(const std::string& root, const std::string& name,
                                const std::vector<std::string>& files);

  /// An explicit directory, made if it is not there.
  /// force    remove the files of an older run first; without it a directory that holds a run is refused
  /// throws   InputError if another process works in it, if it holds a run and force is false, if one of the files is
  ///          there and no run's, if the folder of one is a link, if it is no directory, or cannot be made or written
  ///          to
  static RunDirectory at(const std::string& path, const std::vector<std::string>& files, bool force);

  /// A directory that was made for one run, of which others keep what it holds: without a manifest.
  static RunDirectory made(const std::string& path, const std::vector<std::string>& files);

  RunDirectory(RunDirectory&& other) noexcept;

  const std::string& path() const { return own_.path(); }
  std::string file(const std::string& name) const { return path() + "/" + name; }

  /// What the run set out to find, and what is found and written.
  void plan(const std::vector<std::string>& methods);
  void finished(const std::string& method);

  /// Everything is written: the manifest forgets what was not.
  void settle();

  /// failed.json: the reason, finished and missing methods. Half-written temporary files are removed.
  /// Called at most once takes effect.
  void fail(const std::string& reason);

 private:
  explicit RunDirectory(std::string path) : own_(std::move(path)) {}

  void begin(const std::vector<std::string>& files);
  void remove_leftovers(const std::vector<std::string>& names, bool even_living = false) const;

  OwnDirectory own_;
  std::vector<std::string> files_;
  std::mutex mutex_;
  std::vector<std::string> planned_;
  std::vector<std::string> finished_;
  bool failed_ = false;
};

}  // namespace touchfield
