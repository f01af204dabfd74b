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

/// Where a file's name stands, itself perhaps a link: that is what is removed.
fs::path place_of(const std::string& file) {
  const fs::path path(file);
  return without_links(path.has_parent_path() ? path.parent_path().string() : ".") / path.filename();
}

bool lies_in(const fs::path& path, const fs::path& folder) {
  return std::ranges::mismatch(folder, path).in1 == folder.end();
}

}  // namespace

void require_apart(const std::string& output, const std::vector<std::string>& read) {
  if (output.empty()) {
    return;
  }
  const fs::path out = without_links(output);
  std::set<fs::path> own;
  for (const std::string& name : own_files(output, {}).value_or(std::vector<std::string>())) {
    own.insert(out / name);
  }
  for (const std::string& path : read) {
    std::error_code none;
    const bool is_folder = fs::is_directory(path, none);
    const fs::path place = is_folder ? without_links(path) : place_of(path);
    const auto within = [&](const fs::path& other) { return lies_in(other, place); };
    if (is_folder ? within(out) || std::ranges::any_of(own, within) : own.contains(place)) {
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
    if (open->directory) {
      open->directory->fail(fmt::format("interrupted by {}", signal_name));
      say(fmt::format("\ntouchfield: interrupted by {}; {}\n", signal_name,
                      fmt::format(fmt::runtime(kept), open->directory->file("failed.json"))));
    } else {
      say(fmt::format("\ntouchfield: interrupted by {} before anything was written\n", signal_name));
    }
  });
}

RunDirectory& ClaimedDirectory::claim(const std::string& output, bool force, const std::string& name,
                                      const std::vector<std::string>& files) {
  const std::lock_guard lock(open_->mutex);
  open_->directory = std::make_shared<RunDirectory>(
      output.empty() ? RunDirectory::next_free("results/runs", name, files) : RunDirectory::at(output, files, force));
  return *open_->directory;
}

void ClaimedDirectory::fill(Progress& progress, const std::function<void()>& work) {
  try {
    work();
    release();
  } catch (const std::exception& error) {
    fail(error.what(), progress);
    throw;
  }
}

void ClaimedDirectory::fail(const std::string& reason, Progress& progress) {
  try {
    open_->directory->fail(reason);
  } catch (const IoError& error) {  // the disk may be full; the first error is the one to report
    progress.warn(error.what());
  }
}

void ClaimedDirectory::release() {
  const std::lock_guard lock(open_->mutex);
  open_->directory.reset();
}

}  // namespace touchfield
