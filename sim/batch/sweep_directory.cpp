#include "sim/batch/sweep_directory.h"

#include <algorithm>
#include <fcntl.h>
#include <filesystem>
#include <iterator>
#include <system_error>
#include <unistd.h>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "sim/batch/run_directory.h"
#include "sim/core/errors.h"
#include "sim/core/json_text.h"
#include "sim/core/require.h"
#include "sim/core/text_number.h"
#include "sim/core/version.h"
#include "sim/core/whole_file.h"
#include "sim/store/checksum.h"
#include "sim/store/run_file.h"

namespace touchfield {

namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr const char* kPlanFormat = "touchfield-sweep-plan";
constexpr int kPlanVersion = 3;
constexpr const char* kRecordName = "case.json";
constexpr std::string_view kFormer = ".old";  // of the folder of a case that another one takes the place of
constexpr std::size_t kMostRecordBytes = std::size_t{1} << 28U;  // of a plan or a record

std::string case_name(int number) { return fmt::format("{:05d}", number); }

Json changes_json(const std::vector<SceneChange>& changes) {
  Json json = Json::object();
  for (const SceneChange& change : changes) {
    json[change.path] = change.value;
  }
  return json;
}

std::vector<SceneChange> json_changes(const Json& json) {
  std::vector<SceneChange> changes;
  for (const auto& [path, value] : json.items()) {
    changes.push_back({path, value.get<std::string>()});
  }
  return changes;
}

void write_identity(const std::string& directory, const SweepIdentity& identity) {
  Json cases = Json::array();
  for (const SweepCase& item : identity.cases) {
    cases.push_back(changes_json(item.changes));
  }
  const Json json = {{"format", kPlanFormat},
                     {"format_version", kPlanVersion},
                     {"name", identity.name},
                     {"hash", identity.hash},
                     {"shard", {identity.shard.index, identity.shard.count}},
                     {"parameters", identity.parameters},
                     {"set", changes_json(identity.common)},
                     {"cases", cases},
                     {"sweep", identity.text},
                     {"base", identity.base_text}};
  write_text_file(directory + "/sweep.json", json_text(json, 1) + "\n");
}

std::string describe(const std::vector<SceneChange>& changes) {
  std::string text;
  for (const SceneChange& change : changes) {
    text += fmt::format("{}{}={}", text.empty() ? "" : " ", change.path, change.value);
  }
  return text.empty() ? "no change" : text;
}

/// The first thing in which two plans differ, for a person.
std::string difference(const SweepIdentity& kept, const SweepIdentity& asked) {
  if (kept.shard != asked.shard) {
    return fmt::format("shard {}/{} there, {}/{} requested", kept.shard.index, kept.shard.count, asked.shard.index,
                       asked.shard.count);
  }
  if (kept.common != asked.common) {
    return fmt::format("changes of all cases: {} there, {} requested", describe(kept.common), describe(asked.common));
  }
  for (std::size_t i = 0; i < std::min(kept.cases.size(), asked.cases.size()); ++i) {
    if (kept.cases[i].changes != asked.cases[i].changes) {
      return fmt::format("case {}: {} there, {} requested", i + 1, describe(kept.cases[i].changes),
                         describe(asked.cases[i].changes));
    }
  }
  if (kept.cases.size() != asked.cases.size()) {
    return fmt::format("{} cases there, {} requested", kept.cases.size(), asked.cases.size());
  }
  return kept.base_text != asked.base_text ? "the base scene has changed"
                                           : "a file that the scenes name, or a default of the program, has changed";
}

/// Files of a case's folder that are results: without its record, the log and what was left half-written.
std::vector<SweepRecord::File> files_of(const std::string& folder) {
  std::vector<SweepRecord::File> files;
  try {
    for (const auto& entry : fs::directory_iterator(folder)) {
      const std::string name = entry.path().filename().string();
      if (entry.is_regular_file() && !name.starts_with('.') && name != kRecordName && name != "run.log") {
        files.push_back({name, entry.file_size(), file_checksum(entry.path().string())});
      }
    }
  } catch (const fs::filesystem_error& error) {
    throw IoError(fmt::format("{}: {}", folder, error.code().message()));
  }
  std::ranges::sort(files, {}, &SweepRecord::File::name);
  return files;
}

/// throws   IoError if a file is not what it was
void require_unchanged(const std::string& folder, const std::vector<SweepRecord::File>& files) {
  for (const SweepRecord::File& file : files) {
    const std::string path = folder + "/" + file.name;
    std::error_code error;
    const std::uintmax_t bytes = fs::file_size(path, error);
    if (error) {
      throw IoError(fmt::format("{}: {}", path, error.message()));
    }
    if (bytes != file.bytes) {
      throw IoError(fmt::format("{}: has {} bytes, must have {}", path, bytes, file.bytes));
    }
    if (file_checksum(path) != file.crc32) {
      throw IoError(fmt::format("{}: its checksum has changed", path));
    }
  }
}

/// throws   Error if a case is not what it was when it finished
SweepRecord read_case_record(const std::string& folder, int number) {
  const std::string path = fmt::format("{}/{}", folder, kRecordName);
  SweepRecord record = record_from_json(read_whole_file(path, kMostRecordBytes), path);
  if (record.number != number) {
    throw IoError(fmt::format("{}: is the record of case {}", path, record.number));
  }
  require_unchanged(folder, record.files);
  return record;
}

/// The names that scratch() and land() give: .NUMBER.PROCESS and .NUMBER.old.
bool is_scratch(const std::string& name) {
  const std::size_t point = name.find('.', 1);
  if (!name.starts_with('.') || point == std::string::npos) {
    return false;
  }
  const std::string end = name.substr(point + 1);
  return number_of<int>(name.substr(1, point - 1)) && ("." + end == kFormer || number_of<int>(end));
}

/// Renames survive a power failure once the folder they are in is flushed.
void flush_folder(const std::string& path) {
  const Descriptor folder(::open(path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  fsync(folder.number());
}

/// Moves what no case wrote from a case's former folder into its new one, unless the new one has a file of that name. A
/// link is no folder of the sweep's: what it leads to stays.
void keep_files_of_others(const fs::path& former, const fs::path& place) {
  std::error_code error;
  if (!fs::is_directory(fs::symlink_status(former, error))) {
    return;
  }
  const std::vector<std::string> own =
      own_files(former.string(), own_files(place.string(), {}).value_or(std::vector<std::string>()))
          .value_or(std::vector<std::string>());
  for (const auto& entry : fs::directory_iterator(former, error)) {
    const fs::path name = entry.path().filename();
    if (name != "case.json" && std::find(own.begin(), own.end(), name.string()) == own.end() && !there(place / name)) {
      fs::rename(entry.path(), place / name, error);
    }
  }
}

/// After a kill between the two renames of SweepDirectory::land, or behind them.
void put_back(const fs::path& former, const fs::path& place) {
  std::error_code error;
  if (there(place)) {
    keep_files_of_others(former, place);
  } else {
    fs::rename(former, place, error);
  }
}

}  // namespace

OwnDirectory own_sweep_directory(const std::string& path, const std::string& lock_file) {
  OwnDirectory own(path, lock_file);
  own.remove_leftovers("", [](const std::string& name) { return name.starts_with("sweep"); });
  return own;
}

SweepDirectory::SweepDirectory(const std::string& path) : own_(own_sweep_directory(path, "sweep.lock")) {
  own_.require_own_folder("cases");
  std::error_code error;
  fs::create_directory(path + "/cases", error);
  require(!error, "output directory {} cannot be written to: cases: {}", path, error.message());
}

SweepDirectory SweepDirectory::open(const std::string& path, const SweepIdentity& identity, bool resume) {
  make_directory(path);
  SweepDirectory directory(path);
  if (fs::exists(path + "/sweep.json")) {
    require(resume, "output directory {} already holds a sweep; continue it with --resume, or give another with -o",
            path);
    const SweepIdentity kept = read_identity(path);
    if (kept.version < kPlanVersion) {
      throw InputError(
          fmt::format("output directory {} holds a sweep of an earlier version, which read scenes differently; "
                      "continue it with that version, or give another with -o",
                      path));
    }
    if (kept.hash != identity.hash || kept.shard != identity.shard) {
      throw InputError(fmt::format("output directory {} holds another sweep: {}; give another with -o", path,
                                   difference(kept, identity)));
    }
  } else {
    if (std::error_code error; !fs::is_empty(path + "/cases", error)) {
      throw InputError(fmt::format("output directory {}: cases without a sweep.json are in the way", path));
    }
    try {
      write_identity(path, identity);
    } catch (const Error& failure) {
      throw InputError(fmt::format("output directory {} cannot be written to: {}", path, failure.what()));
    }
  }
  directory.clear_leftovers();
  return directory;
}

/// What a killed owner left half done.
void SweepDirectory::clear_leftovers() const {
  std::error_code error;
  std::vector<fs::path> found;
  for (const auto& entry : fs::directory_iterator(file("cases"), error)) {
    if (is_scratch(entry.path().filename().string())) {
      found.push_back(entry.path());
    }
  }
  for (const fs::path& folder : found) {
    const std::string name = folder.filename().string();
    if (name.ends_with(kFormer)) {
      put_back(folder, folder.parent_path() / name.substr(1, name.size() - 1 - kFormer.size()));
    }
    fs::remove_all(folder, error);
  }
}

CaseRecords SweepDirectory::records() const { return read_records(path()); }

std::string SweepDirectory::scratch(int number) const {
  std::string path = file(fmt::format("cases/.{}.{}", case_name(number), getpid()));
  std::error_code error;
  fs::remove_all(path, error);
  if (!fs::create_directory(path, error) && !error) {
    error = std::make_error_code(std::errc::file_exists);
  }
  if (error) {
    throw IoError(fmt::format("{} cannot be made: {}", path, error.message()));
  }
  return path;
}

void SweepDirectory::land(SweepRecord& record, const std::string& scratch) const {
  record.files = files_of(scratch);
  write_text_file(fmt::format("{}/{}", scratch, kRecordName), to_json(record));
  flush_folder(scratch);
  const std::string place = file("cases/" + case_name(record.number));
  const std::string old = file(fmt::format("cases/.{}{}", case_name(record.number), kFormer));
  std::error_code error;
  if (there(place)) {
    fs::remove_all(old, error);
    fs::rename(place, old, error);
  }
  if (!error) {
    fs::rename(scratch, place, error);
  }
  if (error) {
    throw IoError(fmt::format("{} cannot be put in its place: {}", place, error.message()));
  }
  keep_files_of_others(old, place);
  flush_folder(file("cases"));
  fs::remove_all(old, error);
}

void SweepDirectory::drop(const std::string& scratch) noexcept {
  std::error_code error;
  fs::remove_all(scratch, error);
}

SweepIdentity read_identity(const std::string& directory) {
  const std::string path = directory + "/sweep.json";
  require(fs::exists(path), "{} does not hold a sweep: sweep.json is missing", directory);
  try {
    const Json json = json_from_text<Json>(read_whole_file(path, kMostRecordBytes));
    require(json.at("format") == kPlanFormat, "{}: is not the plan of a sweep (its format must be {})", path,
            kPlanFormat);
    const int version = json.at("format_version").get<int>();
    if (version > kPlanVersion) {
      throw InputError(newer_format(path, version, kPlanVersion));
    }
    require(version >= 1, "{}: format_version = {} must be >= 1", path, version);
    SweepIdentity identity;
    identity.version = version;
    identity.name = json.at("name").get<std::string>();
    identity.hash = json.at("hash").get<std::string>();
    identity.shard = {json.at("shard").at(0).get<int>(), json.at("shard").at(1).get<int>()};
    identity.parameters = json.at("parameters").get<std::vector<std::string>>();
    identity.common = json_changes(json.at("set"));
    identity.text = json.at("sweep").get<std::string>();
    identity.base_text = json.at("base").get<std::string>();
    for (const Json& item : json.at("cases")) {
      identity.cases.push_back({static_cast<int>(identity.cases.size()) + 1, json_changes(item)});
    }
    return identity;
  } catch (const Json::exception& error) {
    throw IoError(fmt::format("{}: damaged: {}", path, error.what()));
  }
}

CaseRecords read_records(const std::string& directory) {
  CaseRecords records;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(directory + "/cases", error)) {
    if (const auto number = number_of<int>(entry.path().filename().string())) {
      try {
        records.whole.emplace(*number, read_case_record(entry.path().string(), *number));
      } catch (const Error& damage) {
        records.damaged.emplace(*number, damage.what());
      }
    }
  }
  return records;
}

std::vector<std::string> shard_directories(const std::string& directory) {
  std::vector<std::string> found;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(directory, error)) {
    if (entry.is_directory() && entry.path().filename().string().starts_with("shard-") &&
        fs::exists(entry.path() / "sweep.json")) {
      found.push_back(entry.path().string());
    }
  }
  std::ranges::sort(found);
  return found;
}

std::string shard_directory(const std::string& directory, Shard shard) {
  return shard.count == 1 ? directory : fmt::format("{}/shard-{}-of-{}", directory, shard.index, shard.count);
}

}  // namespace touchfield
