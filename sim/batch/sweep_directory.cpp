#include "sim/batch/sweep_directory.h"

#include <algorithm>
#include <fcntl.h>
#include <filesystem>
#include <iterator>
#include <ranges>
#include <set>
#include <span>
#include <system_error>
#include <unistd.h>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>
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

/// Files of a case's folder that are results: without its record and what was left half-written.
std::vector<SweepRecord::File> files_of(const std::string& folder) {
  std::vector<SweepRecord::File> files;
  try {
    for (const auto& entry : fs::directory_iterator(folder)) {
      const std::string name = entry.path().filename().string();
      if (entry.is_regular_file() && !name.starts_with('.') && name != kRecordName) {
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

/// Renames survive a power failure once the folder they are in is flushed.
void flush_folder(const std::string& path) {
  const Descriptor folder(::open(path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  fsync(folder.number());
}

/// Whether a folder is what scratch() made: .NUMBER.PROCESS.
bool is_scratch(const std::string& name) {
  const std::size_t point = name.find('.', 1);
  return name.starts_with('.') && point != std::string::npos && number_of<int>(name.substr(1, point - 1)) &&
         number_of<int>(name.substr(point + 1));
}

bool is_folder(const fs::path& path) {  // no link to one
  std::error_code error;
  return fs::is_directory(fs::symlink_status(path, error));
}

/// Gives a finished case its place. What was there goes, but for files that no case wrote, which move to the new one
/// unless it has a file of that name.
void put_in_place(const fs::path& finished, const fs::path& place) {
  std::set<std::string> own = {kRecordName};
  try {
    const std::string path = (place / kRecordName).string();
    for (const SweepRecord::File& file : record_from_json(read_whole_file(path, kMostRecordBytes), path).files) {
      own.insert(file.name);
    }
  } catch (const Error&) {  // NOLINT(bugprone-empty-catch): then all that the new one lacks stays
  }
  std::error_code error;
  for (const auto& entry : is_folder(place) ? fs::directory_iterator(place, error) : fs::directory_iterator()) {
    const fs::path name = entry.path().filename();
    if (!own.contains(name.string()) && !there(finished / name)) {
      fs::rename(entry.path(), finished / name, error);
    }
  }
  fs::remove_all(place, error);
  if (!error) {
    fs::rename(finished, place, error);
  }
  if (error) {
    throw IoError(fmt::format("{} cannot be put in its place: {}", place.string(), error.message()));
  }
}

}  // namespace

OwnDirectory own_sweep_directory(const std::string& path, const std::string& lock_file, bool shared) {
  OwnDirectory own(path, lock_file, shared);
  own.remove_leftovers("", [](const std::string& name) { return name.starts_with("sweep"); });
  return own;
}

SweepDirectory::SweepDirectory(const std::string& path, bool shared)
    : own_(own_sweep_directory(path, "sweep.lock", shared)) {
  own_.require_own_folder("cases");
  std::error_code error;
  fs::create_directory(path + "/cases", error);
  require(!error, "output directory {} cannot be written to: cases: {}", path, error.message());
}

SweepDirectory SweepDirectory::open(const std::string& path, const SweepIdentity& identity, bool shared) {
  make_directory(path);
  SweepDirectory directory(path, shared);
  if (fs::exists(path + "/sweep.json")) {
    const SweepIdentity kept = read_identity(path);
    if (kept.hash != identity.hash) {
      throw InputError(fmt::format("output directory {} holds another sweep: {}; give another with -o", path,
                                   difference(kept, identity)));
    }
  } else {
    const CaseRecords found = read_records(path);
    require(found.whole.empty() && found.damaged.empty(),
            "output directory {}: cases without a sweep.json are in the way", path);
    try {
      write_identity(path, identity);
    } catch (const Error& failure) {
      throw InputError(fmt::format("output directory {} cannot be written to: {}", path, failure.what()));
    }
  }
  if (!shared) {
    directory.clear_leftovers();
  }
  return directory;
}

/// What killed owners left: a finished case gets its place, an unfinished one goes.
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
    if (is_folder(folder) && there(folder / kRecordName)) {
      put_in_place(folder, folder.parent_path() / name.substr(1, name.find('.', 1) - 1));
    }
    fs::remove_all(folder, error);
  }
}

CaseRecords SweepDirectory::records() const { return read_records(path()); }

std::string SweepDirectory::scratch(int number) const {
  for (int mark = getpid();; ++mark) {  // a process of another machine may have this number
    std::string path = file(fmt::format("cases/.{}.{}", case_name(number), mark));
    std::error_code error;
    if (fs::create_directory(path, error)) {
      return path;
    }
    if (error) {
      throw IoError(fmt::format("{} cannot be made: {}", path, error.message()));
    }
  }
}

void SweepDirectory::land(SweepRecord& record, const std::string& scratch) const {
  record.files = files_of(scratch);
  write_text_file(fmt::format("{}/{}", scratch, kRecordName), to_json(record));
  flush_folder(scratch);
  put_in_place(scratch, file("cases/" + case_name(record.number)));
  flush_folder(file("cases"));
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
    require_format(path, json.at("format_version").get<int>(), kPlanVersion);
    SweepIdentity identity;
    identity.name = json.at("name").get<std::string>();
    identity.hash = json.at("hash").get<std::string>();
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
    const auto number = number_of<int>(entry.path().filename().string());
    if (number && !fs::is_empty(entry.path(), error)) {
      try {
        records.whole.emplace(*number, read_case_record(entry.path().string(), *number));
      } catch (const Error& damage) {
        records.damaged.emplace(*number, damage.what());
      }
    }
  }
  return records;
}

SweepSummary summary_of(const SweepPlan& plan, int cases, const std::map<int, SweepRecord>& records) {
  SweepSummary summary{plan.name, cases, plan.parameters, {}};
  std::ranges::copy(records | std::views::values, std::back_inserter(summary.records));
  return summary;
}

SweepCollection collect_sweep(const std::string& directory) {
  const SweepIdentity identity = read_identity(directory);
  const CaseRecords records = read_records(directory);
  SweepCollection collection{summary_of(identity, static_cast<int>(identity.cases.size()), records.whole), {}};
  for (const auto& [number, damage] : records.damaged) {
    collection.gaps.push_back(fmt::format("case {} is damaged: {}", number, damage));
  }
  std::vector<int> missing;
  for (const SweepCase& item : identity.cases) {
    if (!records.whole.contains(item.number) && !records.damaged.contains(item.number)) {
      missing.push_back(item.number);
    }
  }
  if (!missing.empty()) {
    constexpr std::size_t kMost = 10;
    const auto shown = std::span(missing).first(std::min(missing.size(), kMost));
    collection.gaps.push_back(fmt::format(
        "{} lacks {} case{}: {}{}", directory, missing.size(), missing.size() == 1 ? "" : "s", fmt::join(shown, ", "),
        missing.size() > kMost ? fmt::format(" and {} more", missing.size() - kMost) : ""));
  }
  return collection;
}

}  // namespace touchfield
