#pragma once

#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "sim/core/files.h"

namespace touchfield {

/// Makes a directory for results, and those above it.
/// throws   InputError if it cannot be made, or a file is in the way
void make_directory(const std::string& path);

/// The next free ROOT/NAME-NNNN, made here: two processes that start at once get two numbers.
/// throws   InputError if it cannot be made, naming the path and the system's reason
std::string next_directory(const std::string& root, const std::string& name);

/// Where a run that was killed or failed has left what it had finished: NAME.partial, or NAME/run.partial; empty if
/// there is none.
std::string unfinished_run(const std::string& directory);

/// The directory NAME that gets a run. The run is written into NAME.partial, of which this process has the lock, and
/// becomes NAME by one rename. An older run is exchanged for it (renameat2). Where a file system cannot exchange, the
/// older one is NAME.replaced for a moment, and the next start repairs what a kill left. Mount points, links, the
/// current directory and directories in a read-only parent cannot be renamed. Such a NAME is written in
/// NAME/run.partial and gets its files one by one, *.h5 last.
///
/// files.json lists the files of a run, in the directory or a folder of it. Only these are ever removed, by name, and
/// no link or device.
/// Safe to call from several threads: an interrupt is handled beside the run.
class RunDirectory {
 public:
  /// files    names of all that is going to be written
  /// force    replace an older run, and results of an unfinished one; without it both are refused
  /// throws   InputError if another process works in it, if it holds a run and force is false, if it holds a file of
  ///          others, if it is not a directory, or cannot be made or written to
  static RunDirectory at(const std::string& path, const std::vector<std::string>& files, bool force);

  /// A directory that was made for one run, of which others keep what it holds: written in place, without files.json.
  /// To publish it changes nothing.
  static RunDirectory made(const std::string& path);

  /// Where files are written: NAME.partial, and NAME once they are published.
  const std::string& path() const { return path_; }
  std::string file(const std::string& name) const { return path_ + "/" + name; }
  const std::string& name() const { return name_; }

  /// What the user should know of the directory; empty for nothing.
  const std::string& warning() const { return warning_; }

  /// What the run set out to find, and what is found and written.
  void plan(const std::vector<std::string>& methods);
  void finished(const std::string& method);

  /// Everything is written: the run becomes NAME.
  /// throws   IoError if that fails; the run is then whole in path()
  void publish();

  /// failed.json: the reason, finished and missing methods. Called at most once takes effect.
  /// returns   false if the run has been published: nothing has failed
  bool fail(const std::string& reason);

 private:
  RunDirectory() = default;

  void lock(const std::string& path);
  void take_place();
  void empty_place(bool force);
  bool take_name() const;
  void move_files();

  std::string name_;
  std::string path_;
  bool made_ = false;
  bool in_place_ = false;
  bool replaces_ = false;
  std::string warning_;
  std::vector<FileLock> locks_;
  std::vector<std::string> files_;
  std::unique_ptr<std::mutex> mutex_ = std::make_unique<std::mutex>();
  std::vector<std::string> planned_;
  std::vector<std::string> finished_;
  bool failed_ = false;
  bool published_ = false;
};

}  // namespace touchfield
