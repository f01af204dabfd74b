#include "sim/run/run_directory.h"

#include <algorithm>
#include <fcntl.h>
#include <filesystem>
#include <system_error>
#include <unistd.h>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "sim/core/errors.h"
#include "sim/core/version.h"
#include "sim/output/run_file.h"

namespace touchfield {

namespace {

namespace fs = std::filesystem;

/// Every name a run or a study writes; what is none of these is never touched.
bool belongs_to_a_run(const fs::path& file) {
  static const std::vector<std::string> names = {"run.h5",    "metrics.csv", "surface.vtp", "judge.vtp",
                                                 "array.vtp", "run.log",     "failed.json", "target.png",
                                                 "study.csv", "study.txt",   "study.png",   "study.log"};
  const std::string name = file.filename().string();
  const std::string ending = file.extension().string();
  return std::find(names.begin(), names.end(), name) != names.end() || ending == ".vti" ||
         (ending == ".png" && (name.starts_with("pressure_") || name.starts_with("field_"))) ||
         (name.starts_with(".") && name.find(".tmp-") != std::string::npos);
}

bool holds_a_run(const fs::path& directory) {
  return fs::exists(directory / "run.h5") || fs::exists(directory / "failed.json") ||
         fs::exists(directory / "metrics.csv") || fs::exists(directory / "run.log") ||
         fs::exists(directory / "study.csv") || fs::exists(directory / "study.log");
}

void clear_run(const fs::path& directory) {
  for (const auto& entry : fs::directory_iterator(directory)) {
    if (entry.is_regular_file() && belongs_to_a_run(entry.path())) {
      fs::remove(entry.path());
    }
  }
}

/// Permission bits do not tell (root, read-only mounts), a file does.
void require_writable(const fs::path& directory) {
  const std::string probe = (directory / fmt::format(".probe.tmp-{}", getpid())).string();
  const int descriptor = open(probe.c_str(), O_CREAT | O_EXCL | O_WRONLY | O_CLOEXEC, 0600);
  if (descriptor < 0) {
    throw InputError(fmt::format("output directory {} cannot be written to: {}", directory.string(),
                                 std::system_category().message(errno)));
  }
  close(descriptor);
  unlink(probe.c_str());
}

}  // namespace

RunDirectory::RunDirectory(RunDirectory&& other) noexcept
    : path_(std::move(other.path_)),
      planned_(std::move(other.planned_)),
      finished_(std::move(other.finished_)),
      failed_(other.failed_) {}

RunDirectory RunDirectory::next_free(const std::string& root, const std::string& name) {
  std::error_code error;
  fs::create_directories(root, error);
  if (error) {
    throw InputError(fmt::format("output directory {} cannot be made: {}", root, error.message()));
  }
  for (int number = 1;; ++number) {
    const std::string path = fmt::format("{}/{}-{:04d}", root, name, number);
    // create_directory is atomic: false means that somebody else has this number.
    if (fs::create_directory(path, error)) {
      require_writable(path);
      return RunDirectory(path);
    }
    if (error) {
      throw InputError(fmt::format("output directory {} cannot be made: {}", path, error.message()));
    }
  }
}

RunDirectory RunDirectory::at(const std::string& path, bool force) {
  std::error_code error;
  if (fs::exists(path, error) && !fs::is_directory(path, error)) {
    throw InputError(fmt::format("output directory {}: a file of that name is in the way", path));
  }
  fs::create_directories(path, error);
  if (error) {
    throw InputError(fmt::format("output directory {} cannot be made: {}", path, error.message()));
  }
  require_writable(path);
  if (holds_a_run(path)) {
    if (!force) {
      throw InputError(
          fmt::format("output directory {} already holds a run; give another with -o, or --force to replace it", path));
    }
    clear_run(path);
  }
  return RunDirectory(path);
}

void RunDirectory::plan(const std::vector<std::string>& methods) {
  const std::lock_guard lock(mutex_);
  planned_ = methods;
}

void RunDirectory::finished(const std::string& method) {
  const std::lock_guard lock(mutex_);
  finished_.push_back(method);
}

void RunDirectory::fail(const std::string& reason) {
  const std::lock_guard lock(mutex_);
  if (failed_) {
    return;
  }
  failed_ = true;
  std::vector<std::string> missing;
  std::copy_if(planned_.begin(), planned_.end(), std::back_inserter(missing), [&](const std::string& method) {
    return std::find(finished_.begin(), finished_.end(), method) == finished_.end();
  });
  const nlohmann::ordered_json record = {
      {"reason", reason}, {"time", utc_now()}, {"finished_methods", finished_}, {"missing_methods", missing}};
  const std::string own_temporary = fmt::format(".tmp-{}", getpid());
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(path_, error)) {
    if (entry.path().filename().string().ends_with(own_temporary)) {
      fs::remove(entry.path(), error);
    }
  }
  write_text_file(file("failed.json"), record.dump(2) + "\n");
}

}  // namespace touchfield
