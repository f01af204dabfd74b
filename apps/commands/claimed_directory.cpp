#include "apps/commands/claimed_directory.h"

#include <algorithm>
#include <filesystem>
#include <set>
#include <system_error>

#include <fmt/format.h>

#include "apps/commands/interrupt_guard.h"
#include "apps/commands/standard_streams.h"
#include "sim/core/errors.h"
#include "sim/scene/scene_reader.h"

namespace touchfield {

namespace {

namespace fs = std::filesystem;

fs::path without_links(const std::string& path) {
  std::error_code none;
  const fs::path whole = fs::weakly_canonical(fs::absolute(path, none), none);
  return whole.has_filename() ? whole : whole.parent_path();
}

bool lies_in(const fs::path& path, const fs::path& folder) {
  return std::ranges::mismatch(folder, path).in1 == folder.end();
}

}  // namespace

void require_apart(const std::string& output, const std::vector<std::string>& read) {
  for (const std::string& path : read) {
    const fs::path out = without_links(output);
    const fs::path in = without_links(path);
    std::error_code none;
    if (!output.empty() && (lies_in(in, out) || (fs::is_directory(in, none) && lies_in(out, in)))) {
      throw InputError(fmt::format("-o {}: must be another directory, apart from {}, which is read", output, path));
    }
  }
}

void require_apart(const std::string& output, const std::string& scene_file, const Scene& scene) {
  require_apart(output, read_by(scene_file, scene));
}

std::vector<std::string> read_by(const std::string& scene_file, const Scene& scene) {
  const std::set<std::string> named = named_files(scene);
  std::vector<std::string> read(named.begin(), named.end());
  if (!scene_file.empty()) {
    read.push_back(scene_file);
  }
  if (scene.motion) {
    if (const auto* recorded = std::get_if<RecordedSpec>(&scene.motion->sensor.sight)) {
      read.push_back(recorded->folder);
    } else if (const auto* joints = std::get_if<JointsSpec>(&scene.motion->sensor.sight)) {
      if (const auto* file = std::get_if<std::string>(&joints->from)) {
        read.push_back(*file);
      }
    }
  }
  return read;
}

ClaimedDirectory::ClaimedDirectory(const std::string& kept) {
  block_interrupts();
  handle_interrupts([open = open_, kept](const char* signal_name) {
    const std::lock_guard lock(open->mutex);
    if (!open->directory) {
      say(fmt::format("\ntouchfield: interrupted by {} before anything was written\n", signal_name));
    } else if (open->directory->fail(fmt::format("interrupted by {}", signal_name))) {
      say(fmt::format("\ntouchfield: interrupted by {}; {}\n", signal_name,
                      fmt::format(fmt::runtime(kept), open->directory->file("failed.json"))));
    } else {
      say(fmt::format("\ntouchfield: interrupted by {} after all was written\n", signal_name));
    }
  });
}

RunDirectory& ClaimedDirectory::claim(const std::string& output, bool force, const std::string& name,
                                      const std::vector<std::string>& files) {
  const std::lock_guard lock(open_->mutex);
  open_->directory.emplace(
      RunDirectory::at(output.empty() ? next_directory("results/runs", name) : output, files, force));
  return *open_->directory;
}

void ClaimedDirectory::fill(Progress& progress, const std::function<void()>& work) {
  RunDirectory& directory = *open_->directory;
  if (!directory.warning().empty()) {
    progress.warn(directory.warning());
  }
  try {
    work();
  } catch (const std::exception& error) {
    if (directory.fail(error.what())) {
      progress.note(fmt::format("what is finished is in {}", directory.path()));
    }
    throw;
  }
}

}  // namespace touchfield
