#include "sim/run/run_directory.h"

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <iterator>
#include <set>
#include <sys/stat.h>
#include <system_error>
#include <unistd.h>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "sim/core/errors.h"
#include "sim/core/json.h"
#include "sim/core/require.h"
#include "sim/core/version.h"
#include "sim/run/text_table.h"

namespace touchfield {

namespace {

namespace fs = std::filesystem;
constexpr const char* kManifest = "files.json";
constexpr const char* kManifestFormat = "touchfield-files";
constexpr std::size_t kMostManifestBytes = std::size_t{1} << 26U;
constexpr const char* kFailed = "failed.json";
constexpr const char* kPartial = ".partial";
constexpr const char* kReplaced = ".replaced";
constexpr const char* kWithin = "run.partial";

/// What lies in a directory of results.
struct Contents {
  std::set<std::string> listed;   // in its manifest, and that itself; empty without one
  std::vector<fs::path> own;      // files that are listed, and what was left of them half-written
  std::vector<fs::path> folders;  // of such files
  std::string other;              // the name of something else, if there is any
};

/// Whether there is something of a name, be it a link that leads nowhere.
bool there(const fs::path& file) {
  std::error_code error;
  return fs::symlink_status(file, error).type() != fs::file_type::not_found;
}

std::set<std::string> listed_files(const fs::path& directory) {
  std::error_code error;
  if (!fs::is_regular_file(directory / kManifest, error)) {  // a pipe would be waited for
    return {};
  }
  try {
    const std::string text = read_whole_file((directory / kManifest).string(), kMostManifestBytes);
    const Json json = json_from_text<Json>(text);
    if (json.at("format") == kManifestFormat) {
      auto listed = json.at("files").get<std::set<std::string>>();
      listed.insert({kManifest, kFailed});
      return listed;
    }
  } catch (const InputError&) {  // NOLINT(bugprone-empty-catch): then it is a file of others
  } catch (const Json::exception&) {
  }
  return {};
}

void add_contents(const fs::path& folder, const std::string& prefix, const std::string& besides, Contents& contents) {
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    const std::string name = entry.path().filename().string();
    const auto target = target_of_temporary(name);
    const bool is_file = entry.symlink_status().type() == fs::file_type::regular;
    const bool is_folder = entry.symlink_status().type() == fs::file_type::directory;
    const auto within = contents.listed.lower_bound(name + "/");
    if (is_file && (contents.listed.contains(prefix + target.value_or(name)) || target == kManifest)) {
      contents.own.push_back(entry.path());
    } else if (is_folder && prefix.empty() && within != contents.listed.end() && within->starts_with(name + "/")) {
      contents.folders.push_back(entry.path());
      add_contents(entry.path(), name + "/", besides, contents);
    } else if (name != besides) {
      contents.other = prefix + name;
    }
  }
  require(!error, "output directory {} cannot be read: {}", folder.string(), error.message());
}

/// besides   the name of a folder in it that is looked at by itself
Contents contents_of(const fs::path& directory, const std::string& besides = "") {
  Contents contents;
  if (there(directory)) {
    contents.listed = listed_files(directory);
    add_contents(directory, "", besides, contents);
  }
  return contents;
}

void write_manifest(const fs::path& directory, const std::vector<std::string>& files) {
  const Json json = {{"format", kManifestFormat}, {"files", files}};
  write_atomically((directory / kManifest).string(), {json_text(json, 1), "\n"});
}

/// Removes a run's files, its manifest last.
/// returns   the reason why something could not be removed
std::error_code remove_files(const fs::path& directory, const Contents& contents) {
  std::error_code first;
  const auto remove = [&](const fs::path& path) {
    std::error_code error;
    fs::remove(path, error);
    first = first ? first : error;
  };
  for (const fs::path& file : contents.own) {
    if (file.filename() != kManifest) {
      remove(file);
    }
  }
  std::ranges::for_each(contents.folders, remove);
  remove(directory / kManifest);
  return first;
}

/// Removes a run of which nobody wants anything more; what cannot be removed stays.
void drop_run(const fs::path& directory) {
  remove_files(directory, contents_of(directory));
  std::error_code not_empty;
  fs::remove(directory, not_empty);
}

void refuse_others(const std::string& directory, const Contents& contents) {
  require(contents.other.empty(),
          "output directory {}: its {} does not belong to a run; move it, or give another directory with -o", directory,
          contents.other);
}

bool is_result(const fs::path& file) {
  const std::string name = file.filename().string();
  return name != kManifest && name != kFailed && file.extension() != ".log" && !target_of_temporary(name);
}

/// Whether a directory has to keep its name, or another could not take it.
bool must_stay(const fs::path& directory) {
  std::error_code none;
  if (fs::is_symlink(directory, none)) {
    return true;
  }
  struct statx own {};
  struct statx above {};
  const std::string parent = (directory / "..").string();
  ::statx(AT_FDCWD, directory.c_str(), 0, STATX_BASIC_STATS, &own);
  ::statx(AT_FDCWD, parent.c_str(), 0, STATX_BASIC_STATS, &above);
  const bool is_mounted = (own.stx_attributes & STATX_ATTR_MOUNT_ROOT) != 0 ||
                          own.stx_dev_major != above.stx_dev_major || own.stx_dev_minor != above.stx_dev_minor;
  const fs::path whole = fs::canonical(directory, none);
  const fs::path current = fs::current_path(none);
  return is_mounted || ::access(parent.c_str(), W_OK) != 0 || std::ranges::mismatch(whole, current).in1 == whole.end();
}

std::string without_slash(const std::string& directory) {
  const fs::path plain = (fs::path(directory).lexically_normal() / "").parent_path();
  return plain.empty() ? "." : plain.string();
}

}  // namespace

void make_directory(const std::string& path) {
  std::error_code error;
  require(!there(path) || fs::is_directory(path, error), "output directory {}: a file of that name is in the way",
          path);
  fs::create_directories(path, error);
  require(!error, "output directory {} cannot be made: {}", path, error.message());
}

std::string next_directory(const std::string& root, const std::string& name) {
  make_directory(root);
  for (int number = 1;; ++number) {
    std::string path = fmt::format("{}/{}-{:04d}", root, name, number);
    std::error_code error;
    if (fs::create_directory(path, error)) {  // false without an error: somebody else has this number
      return path;
    }
    require(!error, "output directory {} cannot be made: {}", path, error.message());
  }
}

std::string unfinished_run(const std::string& directory) {
  const fs::path name = without_slash(directory);
  std::error_code none;
  for (const fs::path& left : {fs::path(name.string() + kPartial), name / kWithin}) {
    if (fs::is_directory(left, none)) {
      return left.string();
    }
  }
  return "";
}

RunDirectory RunDirectory::at(const std::string& path, const std::vector<std::string>& files, bool force) {
  RunDirectory directory;
  const fs::path name = without_slash(path);
  directory.name_ = name.string();
  directory.files_ = files;
  make_directory(name.has_parent_path() ? name.parent_path().string() : ".");
  directory.take_place();
  try {
    directory.empty_place(force);
    write_manifest(directory.path_, files);
  } catch (const std::exception& error) {
    std::error_code not_empty;
    fs::remove(directory.path_, not_empty);
    if (dynamic_cast<const IoError*>(&error) != nullptr) {
      throw InputError(fmt::format("output directory {} cannot be written to: {}", directory.name_, error.what()));
    }
    throw;
  }
  return directory;
}

RunDirectory RunDirectory::made(const std::string& path) {
  RunDirectory directory;
  directory.name_ = directory.path_ = path;
  directory.made_ = true;
  return directory;
}

void RunDirectory::lock(const std::string& path) {
  try {
    locks_.push_back(FileLock::of_folder(path));
  } catch (const IoError& error) {
    throw InputError(fmt::format("output directory {}", error.what()));
  }
  require(locks_.back().state() != FileLock::State::kElsewhere,
          "output directory {}: another process works in it; wait for it, or give another directory with -o", name_);
  if (locks_.back().state() == FileLock::State::kUnknown) {
    warning_ = fmt::format(
        "locks: the file system of {} has no locks (flock), so nothing keeps two runs from writing there at once",
        name_);
  }
}

void RunDirectory::take_place() {
  std::error_code error;
  require(!there(name_) || fs::is_directory(name_, error), "output directory {}: a file of that name is in the way",
          name_);
  in_place_ = there(name_) && must_stay(name_);
  path_ = in_place_ ? (fs::path(name_) / kWithin).string() : name_ + kPartial;
  lock(in_place_ ? name_ : path_);
}

void RunDirectory::empty_place(bool force) {
  std::error_code error;
  if (in_place_) {
    fs::create_directory(path_, error);
  } else {
    const std::string replaced = name_ + kReplaced;
    if (there(replaced) && !there(name_)) {  // killed between two renames
      fs::rename(replaced, name_, error);
    }
    drop_run(replaced);
    if (there(name_)) {
      lock(name_);
      std::error_code none;
      fs::permissions(path_, fs::status(name_, none).permissions(), none);
    }
  }
  const int refused = there(name_) && ::access(name_.c_str(), W_OK) != 0 ? errno : 0;
  require(!error && refused == 0, "output directory {} cannot be written to: {}", name_,
          error ? error.message() : std::strerror(refused));
  const Contents older = contents_of(name_, in_place_ ? kWithin : "");
  refuse_others(name_, older);
  require(older.own.empty() || force,
          "output directory {} already holds a run; give another with -o, or --force to replace it", name_);
  replaces_ = !older.own.empty();
  const Contents left = contents_of(path_);
  refuse_others(path_, left);
  require(std::ranges::none_of(left.own, is_result) || force,
          "output directory {}: {} holds results of an unfinished run; move it, give another directory with -o, or "
          "--force to replace it",
          name_, path_);
  error = remove_files(path_, left);
  require(!error, "output directory {} cannot be written to: {}", path_, error.message());
}

void RunDirectory::plan(const std::vector<std::string>& methods) {
  const std::lock_guard lock(*mutex_);
  planned_ = methods;
}

void RunDirectory::finished(const std::string& method) {
  const std::lock_guard lock(*mutex_);
  finished_.push_back(method);
}

void RunDirectory::publish() {
  const std::lock_guard lock(*mutex_);
  published_ = made_;
  if (made_) {
    return;
  }
  std::erase_if(files_, [&](const std::string& name) { return !there(file(name)); });
  const Contents older = contents_of(name_, in_place_ ? kWithin : "");
  if (!older.other.empty() || (!older.own.empty() && !replaces_)) {  // since the run began
    throw IoError(fmt::format("output directory {} holds files of others by now; the results are in {}", name_, path_));
  }
  try {
    write_manifest(path_, files_);
  } catch (const IoError&) {  // NOLINT(bugprone-empty-catch): the one that is there names them all, and some more
  }
  if (in_place_ || !take_name()) {
    move_files();
  }
  path_ = name_;
  published_ = true;
}

/// False, and nothing has changed, where the directory cannot be renamed.
bool RunDirectory::take_name() const {
  const std::string replaced = name_ + kReplaced;
  const auto rename = [](const std::string& from, const std::string& to) {
    return ::rename(from.c_str(), to.c_str()) == 0;
  };
  if (rename(path_, name_)) {  // there was none, or an empty one
    return true;
  }
  if (errno != ENOTEMPTY && errno != EEXIST) {
    return false;
  }
  if (::renameat2(AT_FDCWD, path_.c_str(), AT_FDCWD, name_.c_str(), RENAME_EXCHANGE) == 0) {
    drop_run(rename(path_, replaced) ? replaced : path_);
    return true;
  }
  if (!rename(name_, replaced)) {
    return false;
  }
  if (!rename(path_, name_)) {
    rename(replaced, name_);
    return false;
  }
  drop_run(replaced);
  return true;
}

/// The file by which a directory is known as a run comes last, so that no mixture of two runs passes as one.
void RunDirectory::move_files() {
  const Contents older = contents_of(name_, kWithin);
  try {
    remove_files(name_, older);
    write_manifest(name_, files_);
    std::ranges::stable_partition(files_, [](const std::string& name) { return !name.ends_with(".h5"); });
    for (const std::string& name : files_) {
      const fs::path to = fs::path(name_) / name;
      fs::create_directories(to.parent_path());
      fs::rename(file(name), to);
    }
  } catch (const std::exception& error) {
    throw IoError(fmt::format("output directory {}: {}; the results are in {}", name_, error.what(), path_));
  }
  drop_run(path_);
}

bool RunDirectory::fail(const std::string& reason) {
  const std::lock_guard lock(*mutex_);
  if (failed_ || published_) {
    return !published_;
  }
  failed_ = true;
  std::vector<std::string> missing;
  std::ranges::copy_if(planned_, std::back_inserter(missing), [&](const std::string& method) {
    return std::ranges::find(finished_, method) == finished_.end();
  });
  const Json record = {
      {"reason", reason}, {"time", utc_now()}, {"finished_methods", finished_}, {"missing_methods", missing}};
  try {
    write_text_file(file(kFailed), json_text(record, 2) + "\n");
  } catch (const IoError&) {  // NOLINT(bugprone-empty-catch): the disk may be full; the reason is what counts
  }
  return true;
}

}  // namespace touchfield
