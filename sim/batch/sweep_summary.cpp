#include "sim/batch/sweep_summary.h"

#include <algorithm>
#include <filesystem>
#include <set>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "sim/core/errors.h"
#include "sim/core/require.h"

namespace touchfield {

namespace {

/// The first of a list of cases, for a person.
std::string some_of(const std::vector<int>& numbers) {
  constexpr std::size_t kMost = 10;
  const auto shown = std::min(numbers.size(), kMost);
  const std::string text =
      fmt::format("{}", fmt::join(numbers.begin(), numbers.begin() + static_cast<long>(shown), ", "));
  return numbers.size() > kMost ? fmt::format("{} and {} more", text, numbers.size() - kMost) : text;
}

/// What lies in the parts of a sweep, together.
struct Found {
  CaseRecords records;
  std::map<int, std::set<int>> shards;  // by how many there should be: the numbers of those that are there
};

/// Cases of a shard of which there is nothing.
std::vector<int> missing_of(Shard shard, const SweepIdentity& identity, const CaseRecords& records) {
  std::vector<int> missing;
  for (const SweepCase& item : identity.cases) {
    if (shard.has(item.number) && !records.whole.contains(item.number) && !records.damaged.contains(item.number)) {
      missing.push_back(item.number);
    }
  }
  return missing;
}

std::vector<std::string> gaps_of(const std::string& directory, const SweepIdentity& identity, const Found& found) {
  std::vector<std::string> gaps;
  for (const auto& [number, damage] : found.records.damaged) {
    if (!found.records.whole.contains(number)) {
      gaps.push_back(fmt::format("case {} is damaged: {}", number, damage));
    }
  }
  for (const auto& [count, there] : found.shards) {
    for (int index = 1; index <= count; ++index) {
      const std::vector<int> missing = missing_of({index, count}, identity, found.records);
      const std::string path = shard_directory(directory, {index, count});
      const std::string cases =
          fmt::format("{} case{}: {}", missing.size(), missing.size() == 1 ? "" : "s", some_of(missing));
      if (!missing.empty()) {
        gaps.push_back(there.contains(index)
                           ? fmt::format("{} lacks {}", path, cases)
                           : fmt::format("shard {}/{} is missing, {} does not exist: {}", index, count, path, cases));
      }
    }
  }
  return gaps;
}

}  // namespace

SweepSummary summary_of(const SweepIdentity& identity) {
  return {identity.name, static_cast<int>(identity.cases.size()), identity.parameters, {}};
}

std::vector<SweepRecord> listed(const std::map<int, SweepRecord>& records) {
  std::vector<SweepRecord> list;
  list.reserve(records.size());
  for (const auto& [number, record] : records) {
    list.push_back(record);
  }
  return list;
}

SweepCollection collect_sweep(const std::string& directory) {
  std::vector<std::string> parts = shard_directories(directory);
  if (std::filesystem::exists(directory + "/sweep.json")) {
    parts.insert(parts.begin(), directory);
  }
  require(!parts.empty(), "{} does not hold a sweep or a shard of one", directory);
  const SweepIdentity first = read_identity(parts.front());
  Found found;
  for (const std::string& part : parts) {
    const SweepIdentity identity = read_identity(part);
    if (identity.hash != first.hash) {
      throw InputError(fmt::format("{} and {} are of different sweeps", parts.front(), part));
    }
    CaseRecords records = read_records(part);
    found.records.whole.merge(records.whole);
    found.records.damaged.merge(records.damaged);
    found.shards[identity.shard.count].insert(identity.shard.index);
  }
  SweepCollection collection;
  collection.gaps = gaps_of(directory, first, found);
  collection.summary = summary_of(first);
  collection.summary.records = listed(found.records.whole);
  return collection;
}

}  // namespace touchfield
