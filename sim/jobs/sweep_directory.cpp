#include "sim/jobs/sweep_directory.h"

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <iterator>
#include <random>
#include <ranges>
#include <set>
#include <sys/stat.h>
#include <system_error>
#include <unistd.h>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "sim/core/errors.h"
#include "sim/core/json.h"
#include "sim/core/require.h"
#include "sim/core/text.h"
#include "sim/core/version.h"
#include "sim/run/archive_file.h"
#include "sim/run/run_directory.h"
#include "sim/run/text_table.h"

namespace touchfield {

namespace {

namespace fs = std::filesystem;
constexpr const char* kPlanFormat = "touchfield-sweep-plan";
constexpr int kPlanVersion = 4;
constexpr const char* kRecordName = "case.json";
constexpr const char* kLock = ".lock";
constexpr const char* kUnlocked = ".unlocked";                   // ends the names of folders of `--case`
constexpr std::size_t kMostRecordBytes = std::size_t{1} << 28U;  // of a plan or a record

std::string case_name(int number) { return fmt::format("{:05d}", number); }

Json changes_json(const std::vector<SceneChange>& changes) {
  Json json = Json::object();
  for (const SceneChange& change : changes) {
    json[change.path] = change.value;
  }
  return json;
}

void write_plan(const std::string& path, const SweepPlan& plan) {
  Json cases = Json::array();
  for (const SweepCase& item : plan.cases) {
    cases.push_back(changes_json(item.changes));
  }
  const Json json = {
      {"format", kPlanFormat},         {"format_version", kPlanVersion},   {"name", plan.name}, {"hash", plan.hash},
      {"parameters", plan.parameters}, {"set", changes_json(plan.common)}, {"cases", cases},    {"sweep", plan.text},
      {"base", plan.base_text}};
  write_text_file(path, json_text(json, 1) + "\n");
}

/// A plan or a record.
/// throws   Error also if a pipe has its name, which would be waited for
std::string read_own(const std::string& path) {
  std::error_code error;
  require_io(!fs::is_fifo(path, error), path + ": a pipe, must be a file");
  return read_whole_file(path, kMostRecordBytes);
}

/// What a directory says of its sweep: the hash of the plan, and the table without a case.
std::pair<std::string, SweepSummary> read_plan(const std::string& path) {
  try {
    const Json json = json_from_text<Json>(read_own(path));
    require(json.at("format") == kPlanFormat, "{}: is not the plan of a sweep (its format must be {})", path,
            kPlanFormat);
    require_format(path, json.at("format_version").get<int>(), kPlanVersion);
    return {json.at("hash").get<std::string>(),
            {json.at("name").get<std::string>(),
             static_cast<int>(json.at("cases").size()),
             json.at("parameters").get<std::vector<std::string>>(),
             {}}};
  } catch (const Json::exception& error) {
    throw IoError(fmt::format("{}: damaged: {}", path, error.what()));
  }
}

SweepRecord read_case_json(const fs::path& folder) {
  const std::string path = folder / kRecordName;
  return record_from_json(read_own(path), path);
}

/// throws   Error if a case is not what it was when it finished
SweepRecord read_case(const fs::path& folder, int number) {
  SweepRecord record = read_case_json(folder);
  require_io(record.number == number,
             fmt::format("{}: is the record of case {}", (folder / kRecordName).string(), record.number));
  for (const SweepRecord::File& file : record.files) {
    const std::string path = folder / file.name;
    std::error_code error;
    const std::uintmax_t bytes = fs::file_size(path, error);
    require_io(!error, fmt::format("{}: {}", path, error.message()));
    require_io(bytes == file.bytes, fmt::format("{}: has {} bytes, must have {}", path, bytes, file.bytes));
    require_io(file_checksum(path) == file.crc32, fmt::format("{}: its checksum has changed", path));
  }
  return record;
}

/// Renames survive a power failure once the folder they are in is flushed.
void flush_folder(const std::string& path) {
  const Descriptor folder(::open(path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  fsync(folder.number());
}

/// The number that a case's folder begins with; nothing if it is none.
std::optional<int> case_number(std::string_view name) { return number_of<int>(name.substr(0, name.find('.'))); }

/// What a directory without a plan holds of another sweep; empty for nothing. Schedulers make empty folders for cases.
std::string foreign_result(const std::string& directory) {
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(directory, error)) {
    const std::string name = entry.path().filename().string();
    const bool is_plot = name.starts_with("sweep_") && name.ends_with(".png");
    if (is_plot || name == "sweep.csv" || name == "sweep.log" ||
        (name == "cases" && std::ranges::any_of(fs::directory_iterator(entry.path(), error),
                                                [&](const auto& one) { return !fs::is_empty(one.path(), error); }))) {
      return name;
    }
  }
  return "";
}

/// A case that is there gets the files of a new one, and loses those that only it had. It is damaged meanwhile.
void replace_files(const fs::path& finished, const fs::path& place) {
  std::set<std::string> older = {"failed.json"};
  try {
    std::ranges::transform(read_case_json(place).files, std::inserter(older, older.end()), &SweepRecord::File::name);
  } catch (const Error&) {  // NOLINT(bugprone-empty-catch): then all that the new one lacks stays
  }
  fs::remove(place / kRecordName);
  for (const SweepRecord::File& file : read_case_json(finished).files) {
    older.erase(file.name);
    fs::rename(finished / file.name, place / file.name);
  }
  for (const std::string& name : older) {
    fs::remove(place / name);
  }
  flush_folder(place);
  fs::rename(finished / kRecordName, place / kRecordName);
  flush_folder(place);
  std::error_code error;
  fs::remove_all(finished, error);
}

}  // namespace

void require_io(bool holds, const std::string& message) {
  if (!holds) {
    throw IoError(message);
  }
}

SweepDirectory SweepDirectory::open(const std::string& path, const SweepPlan& plan) {
  make_directory(path);
  const SweepDirectory directory(path);
  const std::string foreign = foreign_result(path);
  if (!fs::exists(directory.file("sweep.json"))) {  // another process writes it before all else
    require(
        foreign.empty(),
        "output directory {}: its {} is of another sweep, which has no sweep.json; move it, or give another with -o",
        path, foreign);
    try {
      write_plan(directory.file("sweep.json"), plan);
    } catch (const Error& failure) {
      throw InputError(fmt::format("output directory {} cannot be written to: {}", path, failure.what()));
    }
  }
  require(
      read_plan(directory.file("sweep.json")).first == plan.hash,
      "output directory {} holds another sweep: {}/sweep.json is not of {} as it is now, with --set, its base scene "
      "and the files that they name; give another with -o",
      path, path, plan.path);
  std::error_code error;
  fs::create_directory(directory.file("cases"), error);
  require(!error, "output directory {} cannot be written to: cases: {}", path, error.message());
  return directory;
}

std::string SweepDirectory::lock_file(int number) const {
  return file(fmt::format("cases/.{}{}", case_name(number), kLock));
}

std::optional<FileLock> SweepDirectory::lock(int number) const {
  FileLock lock = FileLock::of_file(lock_file(number));
  if (lock.state() == FileLock::State::kUnknown) {
    std::error_code error;
    fs::remove(lock_file(number), error);
    throw InputError(fmt::format(
        "output directory {}: its file system has no locks; give a folder of another one with -o, or give each process "
        "its own cases with --case FIRST-LAST, which takes no locks",
        path_));
  }
  return lock.state() == FileLock::State::kHeld ? std::optional(std::move(lock)) : std::nullopt;
}

std::optional<SweepRecord> SweepDirectory::record(int number) const {
  const std::string folder = file("cases/" + case_name(number));
  std::error_code error;
  return !fs::is_directory(folder, error) || fs::is_empty(folder, error) ? std::nullopt
                                                                         : std::optional(read_case(folder, number));
}

std::string SweepDirectory::scratch(int number, bool locked) const {
  std::string host(HOST_NAME_MAX + 1, '\0');
  ::gethostname(host.data(), HOST_NAME_MAX);
  host.resize(std::strlen(host.c_str()));
  std::ranges::replace_if(
      host, [](unsigned char letter) { return std::isalnum(letter) == 0; }, '-');
  std::random_device random;
  std::error_code error;
  std::string path;
  do {
    path = file(fmt::format("cases/.{}.{}.{:08x}{:08x}{}", case_name(number), host, random(), random(),
                            locked ? "" : kUnlocked));
  } while (!fs::create_directory(path, error) && !error);
  require_io(!error, fmt::format("{} cannot be made: {}", path, error.message()));
  return path;
}

std::string SweepDirectory::land(int number, const std::string& scratch) const {
  const fs::path place = file("cases/" + case_name(number));
  if (::rename(scratch.c_str(), place.c_str()) == 0) {  // an empty folder may be there
    flush_folder(file("cases"));
    return "";
  }
  std::error_code reason(errno, std::generic_category());
  std::error_code error;
  require_io(fs::exists(fs::symlink_status(place, error)),
             fmt::format("{} cannot be put in its place: {}", place.string(), reason.message()));
  try {
    const std::optional<SweepRecord> there = record(number);
    if (there && there->status == "ok") {
      fs::remove_all(scratch, error);
      return "";
    }
  } catch (const Error&) {  // NOLINT(bugprone-empty-catch): it is damaged
  }
  if (reason == std::errc::directory_not_empty || reason == std::errc::file_exists) {
    try {
      replace_files(scratch, place);
      return "";
    } catch (const fs::filesystem_error& failure) {
      reason = failure.code();
    }
  }
  fs::remove_all(scratch, error);
  return fmt::format("{} cannot be replaced: {}; remove it, and the same command computes it", place.string(),
                     reason.message());
}

void SweepDirectory::clear_leftovers(const std::map<int, SweepRecord>& known) const {
  std::error_code error;
  std::vector<fs::path> found;
  std::ranges::transform(fs::directory_iterator(file("cases"), error), std::back_inserter(found),
                         [](const auto& entry) { return entry.path(); });
  for (const fs::path& folder : found) {
    const std::string name = folder.filename().string();
    const auto number = name.starts_with('.') ? case_number(std::string_view(name).substr(1)) : std::nullopt;
    if (!number) {
      continue;
    }
    const auto there = known.find(*number);
    const bool done = there != known.end() && there->second.status == "ok";
    if (done || (!name.ends_with(kLock) && !name.ends_with(kUnlocked) && lock(*number))) {
      fs::remove_all(folder, error);
    }
  }
}

void SweepDirectory::unlock(int number, std::optional<FileLock>& lock) const {
  std::error_code error;
  fs::remove(lock_file(number), error);  // who has opened it meanwhile finds the case finished
  lock.reset();
}

void write_record(SweepRecord record, const std::string& scratch) {
  try {
    for (const auto& entry : fs::directory_iterator(scratch)) {
      const std::string name = entry.path().filename().string();
      if (name.starts_with('.')) {  // half-written
        fs::remove_all(entry.path());
      } else if (entry.is_regular_file()) {
        record.files.push_back({name, entry.file_size(), file_checksum(entry.path().string())});
      }
    }
  } catch (const fs::filesystem_error& error) {
    throw IoError(fmt::format("{}: {}", scratch, error.code().message()));
  }
  std::ranges::sort(record.files, {}, &SweepRecord::File::name);
  write_text_file(fmt::format("{}/{}", scratch, kRecordName), to_json(record));
  flush_folder(scratch);
}

CaseRecords read_records(const std::string& directory) {
  CaseRecords records;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(directory + "/cases", error)) {
    const auto number = number_of<int>(entry.path().filename().string());
    if (number && !fs::is_empty(entry.path(), error)) {
      try {
        records.whole.emplace(*number, read_case(entry.path(), *number));
      } catch (const Error& damage) {
        records.damaged.emplace(*number, damage.what());
      }
    }
  }
  return records;
}

SweepSummary read_sweep_summary(const std::string& directory) {
  const std::string path = directory + "/sweep.json";
  require(fs::exists(path), "{} does not hold a sweep: sweep.json is missing", directory);
  SweepSummary summary = read_plan(path).second;
  std::ranges::copy(read_records(directory).whole | std::views::values, std::back_inserter(summary.records));
  return summary;
}

}  // namespace touchfield
