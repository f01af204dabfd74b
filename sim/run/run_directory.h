#pragma once

#include <mutex>
#include <string>
#include <vector>

namespace touchfield {

/// The directory a run lands in, claimed before anything is computed, and the record of what it holds.
/// Safe to call from several threads: an interrupt is handled beside the run.
class RunDirectory {
 public:
  /// The next free ROOT/NAME-NNNN, made here. Two runs that start at once get two numbers.
  /// throws   InputError if it cannot be made, naming the path and the system's reason
  static RunDirectory next_free(const std::string& root, const std::string& name);

  /// An explicit directory, made if it is not there.
  /// force    clear the files of an older run first; without it a directory that holds a run is refused
  /// throws   InputError if it holds a run and force is false, is no directory, or cannot be made or written to
  static RunDirectory at(const std::string& path, bool force);

  /// A directory that was made for one run.
  static RunDirectory made(const std::string& path) { return RunDirectory(path); }

  RunDirectory(RunDirectory&& other) noexcept;

  const std::string& path() const { return path_; }
  std::string file(const std::string& name) const { return path_ + "/" + name; }

  /// What the run set out to find, and what is found and written.
  void plan(const std::vector<std::string>& methods);
  void finished(const std::string& method);

  /// failed.json: the reason, finished and missing methods. Half-written temporary files of this process are removed.
  /// Called at most once takes effect.
  void fail(const std::string& reason);

 private:
  explicit RunDirectory(std::string path) : path_(std::move(path)) {}

  std::string path_;
  std::mutex mutex_;
  std::vector<std::string> planned_;
  std::vector<std::string> finished_;
  bool failed_ = false;
};

}  // namespace touchfield
