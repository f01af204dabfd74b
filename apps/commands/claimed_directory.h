#pragma once

#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "sim/batch/run_directory.h"
#include "sim/core/progress.h"

namespace touchfield {

/// throws   InputError if results would land in the folder of the images that they are made of: --force would remove those
void require_apart(const std::string& output, const std::string& images);

/// The directory of a command's results, closed by an interrupt as well: from this object's making on signals are taken by a
/// thread of their own, so it is made before any other thread.
class ClaimedDirectory {
 public:
  /// kept   what an interrupt says of what is already written, after "interrupted; "; {} stands for failed.json
  explicit ClaimedDirectory(const std::string& kept);

  /// Claims `output`, or results/runs/NAME-NNNN if it is empty.
  /// throws   as RunDirectory
  RunDirectory& claim(const std::string& output, bool force, const std::string& name,
                      const std::vector<std::string>& files);

  /// Records why the work ended early; a warning where that cannot be written.
  void fail(const std::string& reason, Progress& progress);

  /// Everything is written: an interrupt from here on finds nothing to close.
  void release();

 private:
  struct Open {
    std::mutex mutex;
    std::shared_ptr<RunDirectory> directory;
  };
  std::shared_ptr<Open> open_ = std::make_shared<Open>();
};

}  // namespace touchfield
