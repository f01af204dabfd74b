#include "sim/batch/run_directory.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <system_error>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "sim/core/atomic_file.h"
#include "sim/core/errors.h"
#include "sim/core/version.h"
#include "sim/store/run_file.h"

namespace touchfield {

namespace {

namespace fs = std::filesystem;

constexpr const char* kManifest = "files.json";
constexpr const char* kManifestFormat = "touchfield-files";

/// What runs and studies wrote before they kept a manifest, whatever the scene.
const std::vector<std::string>& older_files() {
  static const std::vector<std::string> kNames = {"run.h5",    "metrics.csv", "surface.vtp", "judge.vtp",
                                                  "array.vtp", "run.log",     "failed.json", "study.csv",
                                                  "study.txt", "study.png",   "study.log"};
  return kNames;
}

bool there(const fs::path& file) {
  std::error_code error;
  return fs::symlink_status(file, error).type() != fs::file_type::not_found;
}

bool holds_an_older_run(const fs::path& directory) {
  const auto has = [&](const char* name) { return there(directory / name); };
  return has("run.h5") || has("failed.json") || (has("metrics.csv") && has("run.log")) ||
         (has("study.csv") && has("study.log"));
}

bool is_plain_name(const std::string& name) {
  return !name.empty() && name != "." && name != ".." && name.find('/') == std::string::npos;
}

/// A file in the directory itself or in a folder of it.
bool is_own_name(const std::string& name) {
  const std::size_t slash = name.find('/');
  return is_plain_name(name.substr(0, slash)) && (slash == std::string::npos || is_plain_name(name.substr(slash + 1)));
}

/// The names in a directory's manifest; nothing if there is none, or another file of its name.
std::optional<std::vector<std::string>> manifest(const fs::path& directory) {
  std::ifstream file(directory / kManifest);
  const nlohmann::json json = nlohmann::json::parse(file, nullptr, false);
  if (!json.is_object() || json.value("format", nlohmann::json()) != kManifestFormat || !json.contains("files") ||
      !json["files"].is_array()) {
    return std::nullopt;
  }
  std::vector<std::string> names;
  for (const nlohmann::json& name : json["files"]) {
    if (name.is_string() && is_own_name(name.get<std::string>())) {
      names.push_back(name.get<std::string>());
    }
  }
  return names;
}

bool contains(const std::vector<std::string>& names, const std::string& name) {
  return std::ranges::find(names, name) != names.end();
}

/// With those above it.
void make_directory(const std::string& path) {
  std::error_code error;
  if (fs::exists(path, error) && !fs::is_directory(path, error)) {
    throw InputError(fmt::format("output directory {}: a file of that name is in the way", path));
  }
  fs::create_directories(path, error);
  if (error) {
    throw InputError(fmt::format("output directory {} cannot be made: {}", path, error.message()));
  }
}

void write_manifest(const fs::path& directory, const std::vector<std::string>& files) {
  const nlohmann::ordered_json json = {{"format", kManifestFormat}, {"files", files}};
  write_atomically((directory / kManifest).string(), {json.dump(1), "\n"});
}

void remove_leftovers(const fs::path& directory, const std::vector<std::string>& files) {
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(directory, error)) {
    const std::string name = entry.path().filename().string();
    if (std::ranges::any_of(files, [&](const std::string& file) { return is_leftover(name, file); })) {
      fs::remove(entry.path(), error);
    }
  }
}

void require_nothing_in_the_way(const fs::path& directory, const std::vector<std::string>& files,
                                const std::vector<std::string>& own) {
  for (const std::string& file : files) {
    if (there(directory / file) && !contains(own, file)) {
      throw InputError(fmt::format(
          "output directory {}: its file {} is of no run and would be overwritten; move it, or give another directory "
          "with -o",
          directory.string(), file));
    }
  }
}

}  // namespace

std::optional<std::vector<std::string>> own_files(const std::string& directory, const std::vector<std::string>& files) {
  std::optional<std::vector<std::string>> own = manifest(directory);
  if (!own && holds_an_older_run(directory)) {
    own = older_files();
    own->insert(own->end(), files.begin(), files.end());
  }
  if (own) {
    own->emplace_back(kManifest);
  }
  return own;
}

RunDirectory::RunDirectory(RunDirectory&& other) noexcept
    : path_(std::move(other.path_)),
      files_(std::move(other.files_)),
      planned_(std::move(other.planned_)),
      finished_(std::move(other.finished_)),
      failed_(other.failed_) {}

void RunDirectory::claim(const std::vector<std::string>& files) {
  if (files.empty()) {
    return;
  }
  files_ = files;
  try {
    write_manifest(path_, files_);
  } catch (const IoError& error) {
    throw InputError(fmt::format("output directory {} cannot be written to: {}", path_, error.what()));
  }
}

RunDirectory RunDirectory::next_free(const std::string& root, const std::string& name,
                                     const std::vector<std::string>& files) {
  make_directory(root);
  for (int number = 1;; ++number) {
    const std::string path = fmt::format("{}/{}-{:04d}", root, name, number);
    std::error_code error;
    // create_directory is atomic: false means that somebody else has this number.
    if (fs::create_directory(path, error)) {
      RunDirectory directory(path);
      directory.claim(files);
      return directory;
    }
    if (error) {
      throw InputError(fmt::format("output directory {} cannot be made: {}", path, error.message()));
    }
  }
}

RunDirectory RunDirectory::at(const std::string& path, const std::vector<std::string>& files, bool force) {
  make_directory(path);
  const std::optional<std::vector<std::string>> older = own_files(path, files);
  if (older && !force) {
    throw InputError(
        fmt::format("output directory {} already holds a run; give another with -o, or --force to replace it", path));
  }
  std::vector<std::string> all = files;
  all.emplace_back(kManifest);
  require_nothing_in_the_way(path, all, older.value_or(std::vector<std::string>()));
  RunDirectory directory(path);
  if (older) {
    directory.clear(*older);
  }
  directory.claim(files);
  return directory;
}

RunDirectory RunDirectory::made(const std::string& path, const std::vector<std::string>& files) {
  RunDirectory directory(path);
  directory.claim(files);
  return directory;
}

void RunDirectory::clear(const std::vector<std::string>& names) const {
  for (const std::string& name : names) {
    const fs::path file = fs::path(path_) / name;
    std::error_code error;
    if (!fs::is_directory(fs::symlink_status(file, error)) && !fs::remove(file, error) && error) {
      throw InputError(fmt::format("output directory {} cannot be written to: {}: {}", path_, name, error.message()));
    }
  }
  remove_leftovers(path_, names);
}

void RunDirectory::settle() {
  const std::lock_guard lock(mutex_);
  std::erase_if(files_, [&](const std::string& name) { return !there(fs::path(path_) / name); });
  try {
    write_manifest(path_, files_);
  } catch (const IoError&) {  // the one that is there names them all, and some more
  }
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
  std::ranges::copy_if(planned_, std::back_inserter(missing),
                       [&](const std::string& method) { return !contains(finished_, method); });
  const nlohmann::ordered_json record = {
      {"reason", reason}, {"time", utc_now()}, {"finished_methods", finished_}, {"missing_methods", missing}};
  remove_leftovers(path_, files_);
  write_text_file(file("failed.json"), record.dump(2) + "\n");
}

}  // namespace touchfield
