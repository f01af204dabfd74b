#pragma once

#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "sim/batch/run_directory.h"
#include "sim/core/progress.h"
#include "sim/scene/scene.h"

namespace touchfield {

/// Results never take the place of what they are made of.
///
/// output   of a command; empty: a new directory, which is always another one
/// read     files and folders that it reads
/// throws   InputError if the output is a folder that is read or lies in one, or if a file that is read, or one in such
///          a folder, is of the run that the output holds: --force would remove it
void require_apart(const std::string& output, const std::vector<std::string>& read);
/// The same of what a scene reads.
void require_apart(const std::string& output, const std::string& scene_file, const Scene& scene);

/// What a scene reads: its file unless that is "", the files that it names and the folder of recorded images.
std::vector<std::string> read_by(const std::string& scene_file, const Scene& scene);

/// The directory of a command's results. An interrupt closes it as well: from the construction of this object on, a
/// thread of its own takes the signals. So it must be made before any other thread.
class ClaimedDirectory {
 public:
  /// kept   what an interrupt says of what is already written, after "interrupted by SIGINT; "; {} stands for
  ///        failed.json
  explicit ClaimedDirectory(const std::string& kept);

  /// Claims `output`, or results/runs/NAME-NNNN if it is empty.
  /// throws   as RunDirectory
  RunDirectory& claim(const std::string& output, bool force, const std::string& name,
                      const std::vector<std::string>& files);

  /// The work of a command in what it claimed: released when it is done; if it throws, recorded as fail() does and
  /// thrown on.
  void fill(Progress& progress, const std::function<void()>& work);

 private:
  /// Records why the work ended early; a warning where that cannot be written.
  void fail(const std::string& reason, Progress& progress);

  /// Everything is written: an interrupt from here on finds nothing to close.
  void release();

  struct Open {
    std::mutex mutex;
    std::shared_ptr<RunDirectory> directory;
  };
  std::shared_ptr<Open> open_ = std::make_shared<Open>();
};

}  // namespace touchfield
