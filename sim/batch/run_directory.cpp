#include "sim/batch/run_directory.h"

#include <algorithm>
#include <filesystem>
#include <map>
#include <set>
#include <system_error>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "sim/core/atomic_file.h"
#include "sim/core/errors.h"
#include "sim/core/json_text.h"
#include "sim/core/require.h"
#include "sim/core/version.h"
#include "sim/core/whole_file.h"
#include "sim/store/run_file.h"

namespace touchfield {

namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr const char* kManifest = "files.json";
constexpr const char* kManifestFormat = "touchfield-files";
constexpr std::size_t kMostManifestBytes = std::size_t{1} << 26U;

/// What runs and studies wrote before they kept a manifest, whatever the scene.
const std::vector<std::string>& older_files() {
  static const std::vector<std::string> kNames = {"run.h5",    "metrics.csv", "surface.vtp", "judge.vtp",
                                                  "array.vtp", "run.log",     "failed.json", "study.csv",
                                                  "study.txt", "study.png",   "study.log"};
  return kNames;
}

bool holds_an_older_run(const fs::path& directory) {
  const auto has = [&](const char* name) { return there(directory / name); };
  return has("run.h5") || has("failed.json") || (has("metrics.csv") && has("run.log")) ||
         (has("study.csv") && has("study.log"));
}

bool is_plain_name(const std::string& name) {
  constexpr std::string_view kNeither("/\0", 2);
  return !name.empty() && name != "." && name != ".." && name.find_first_of(kNeither) == std::string::npos;
}

/// A file in the directory itself or in a folder of it.
bool is_own_name(const std::string& name) {
  const std::size_t slash = name.find('/');
  return is_plain_name(name.substr(0, slash)) && (slash == std::string::npos || is_plain_name(name.substr(slash + 1)));
}

/// The names in a directory's manifest; nothing if there is none, or another file of its name.
std::optional<std::vector<std::string>> manifest(const fs::path& directory) {
  Json json;
  try {
    json = json_from_text<Json>(read_whole_file((directory / kManifest).string(), kMostManifestBytes));
  } catch (const InputError&) {
    return std::nullopt;
  } catch (const Json::exception&) {
    return std::nullopt;
  }
  if (!json.is_object() || json.value("format", Json()) != kManifestFormat || !json.contains("files") ||
      !json["files"].is_array()) {
    return std::nullopt;
  }
  std::vector<std::string> names;
  for (const Json& name : json["files"]) {
    if (name.is_string() && is_own_name(name.get<std::string>())) {
      names.push_back(name.get<std::string>());
    }
  }
  return names;
}

bool contains(const std::vector<std::string>& names, const std::string& name) {
  return std::ranges::find(names, name) != names.end();
}

void write_manifest(const fs::path& directory, const std::vector<std::string>& files) {
  const Json json = {{"format", kManifestFormat}, {"files", files}};
  write_atomically((directory / kManifest).string(), {json_text(json, 1), "\n"});
}

/// The names in each folder; of the directory itself under "".
std::map<std::string, std::set<std::string>> by_folder(const std::vector<std::string>& names) {
  std::map<std::string, std::set<std::string>> folders;
  for (const std::string& name : names) {
    const std::size_t slash = name.find('/');
    const bool in_folder = slash != std::string::npos;
    folders[in_folder ? name.substr(0, slash) : ""].insert(in_folder ? name.substr(slash + 1) : name);
  }
  return folders;
}

void require_nothing_in_the_way(const fs::path& directory, const std::vector<std::string>& files,
                                const std::vector<std::string>& own) {
  for (const std::string& file : files) {
    if (there(directory / file) && !contains(own, file)) {
      throw InputError(
          fmt::format("output directory {}: its file {} does not belong to a run and would be overwritten; move it, or "
                      "give another directory with -o",
                      directory.string(), file));
    }
  }
}

}  // namespace

void make_directory(const std::string& path) {
  std::error_code error;
  if (fs::exists(path, error) && !fs::is_directory(path, error)) {
    throw InputError(fmt::format("output directory {}: a file of that name is in the way", path));
  }
  fs::create_directories(path, error);
  require(!error, "output directory {} cannot be made: {}", path, error.message());
}

bool there(const fs::path& file) {
  std::error_code error;
  return fs::symlink_status(file, error).type() != fs::file_type::not_found;
}

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
    : own_(std::move(other.own_)),
      files_(std::move(other.files_)),
      planned_(std::move(other.planned_)),
      finished_(std::move(other.finished_)),
      failed_(other.failed_) {}

void RunDirectory::begin(const std::vector<std::string>& files) {
  if (files.empty()) {
    return;
  }
  files_ = files;
  try {
    write_manifest(path(), files_);
  } catch (const IoError& error) {
    throw InputError(fmt::format("output directory {} cannot be written to: {}", path(), error.what()));
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
      directory.begin(files);
      return directory;
    }
    require(!error, "output directory {} cannot be made: {}", path, error.message());
  }
}

RunDirectory RunDirectory::at(const std::string& path, const std::vector<std::string>& files, bool force) {
  make_directory(path);
  RunDirectory directory(path);
  const std::optional<std::vector<std::string>> older = own_files(path, files);
  if (older && !force) {
    throw InputError(
        fmt::format("output directory {} already holds a run; give another with -o, or --force to replace it", path));
  }
  std::vector<std::string> all = files;
  all.emplace_back(kManifest);
  require_nothing_in_the_way(path, all, older.value_or(std::vector<std::string>()));
  for (const auto& [folder, names] : by_folder(files)) {
    if (!folder.empty()) {
      directory.own_.require_own_folder(folder);
    }
  }
  if (older) {
    std::ranges::for_each(*older, [&](const std::string& name) { directory.own_.remove(name); });
    directory.remove_leftovers(*older);
  }
  directory.remove_leftovers(all);
  directory.begin(files);
  return directory;
}

RunDirectory RunDirectory::made(const std::string& path, const std::vector<std::string>& files) {
  RunDirectory directory(path);
  directory.files_ = files;
  return directory;
}

void RunDirectory::remove_leftovers(const std::vector<std::string>& names, bool even_living) const {
  for (const auto& [folder, own] : by_folder(names)) {
    own_.remove_leftovers(
        folder, [&own = own](const std::string& name) { return own.contains(name); }, even_living);
  }
}

void RunDirectory::settle() {
  const std::lock_guard lock(mutex_);
  std::erase_if(files_, [&](const std::string& name) { return !there(file(name)); });
  try {
    write_manifest(path(), files_);
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
  const Json record = {
      {"reason", reason}, {"time", utc_now()}, {"finished_methods", finished_}, {"missing_methods", missing}};
  remove_leftovers(files_, true);
  write_text_file(file("failed.json"), json_text(record, 2) + "\n");
}

}  // namespace touchfield
