#pragma once

#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "sim/core/progress.h"
#include "sim/run/run_directory.h"
#include "sim/scene/scene.h"

namespace touchfield {

/// Results never take the place of what they are made of.
///
/// output   of a command; empty: a new directory, which is always another one
/// read     files and folders that it reads
/// throws   InputError if one of them lies in the output, or the output in a folder that is read
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

  /// The work of a command in what it claimed, publish() included. What it throws is recorded as fail() does, and
  /// thrown on.
  void fill(Progress& progress, const std::function<void()>& work);

 private:
  struct Open {
    std::mutex mutex;
    std::optional<RunDirectory> directory;
  };
  std::shared_ptr<Open> open_ = std::make_shared<Open>();
};

}  // namespace touchfield
