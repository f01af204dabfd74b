#include "sim/scene/schema_map.h"

#include <algorithm>
#include <set>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "sim/core/renamed.h"
#include "sim/scene/schema_info.h"

namespace touchfield::schema {

namespace {

bool check_known(const Input& in, const MapInfo& info, std::set<std::string>& meant) {
  bool good = true;
  const auto& entries = in.node().entries;
  const std::vector<std::string> names = info.names();
  for (std::size_t i = 0; i < entries.size(); ++i) {
    const auto& entry = entries[i];
    const auto report = [&](const std::string& text) {
      in.reading().add(entry.place, fmt::format("{}: {}", in.path_of(entry.key), text));
      good = false;
    };
    const auto first = std::find_if(entries.begin(), entries.end(), [&](const Entry& e) { return e.key == entry.key; });
    if (first != entries.begin() + static_cast<std::ptrdiff_t>(i)) {
      report(fmt::format("given twice, first in line {}", first->place.line));
      continue;
    }
    if (contains(names, entry.key)) {
      continue;
    }
    const std::string now = new_name(NameOf::kKey, entry.key);
    const std::string nearest = nearest_key(info, entry.key);
    if (contains(names, now)) {
      meant.insert(now);
      report(fmt::format("this key is called {}", now));
    } else if (!nearest.empty()) {
      meant.insert(nearest.substr(0, nearest.find('.')));
      report(fmt::format("unknown key, did you mean {}?", nearest));
    } else if (info.keys.empty()) {
      report("unknown key, no keys are allowed here");
    } else {
      report(fmt::format("unknown key, known keys are {}", fmt::join(names, ", ")));
    }
  }
  return good;
}

// The key of the group that is given, if exactly one is.
bool check_group(const Input& in, const Group& group, const std::set<std::string>& meant, std::string& chosen) {
  std::vector<std::string> given;
  Place last = in.node().place;
  for (const auto& entry : in.node().entries) {
    if (!contains(group.keys, entry.key) || in.node().find(entry.key) != &entry) {
      continue;
    }
    given.push_back(entry.key);
    last = given.size() > 1 ? std::max(last, entry.place) : entry.place;
  }
  const std::string path = in.path().empty() ? "" : in.path() + ": ";
  if (given.size() > 1) {
    in.reading().add(last, fmt::format("{}{} given, must be {} one of {}", path, fmt::join(given, " and "),
                                       group.required ? "exactly" : "at most", fmt::join(group.keys, ", ")));
    return false;
  }
  if (given.empty()) {
    const bool misspelt =
        std::any_of(group.keys.begin(), group.keys.end(), [&](const auto& key) { return meant.contains(key); });
    if (group.required && !misspelt) {
      in.problem(fmt::format("none of {} given, must be exactly one", fmt::join(group.keys, ", ")));
    }
    return !group.required;
  }
  chosen = given.front();
  return true;
}

// What the chosen key of the group asks of this one.
bool check_beside(const Input& in, const KeyInfo& key, const std::string& chosen, bool misspelt) {
  const Entry* entry = in.node().find(key.name);
  if (entry && !key.fits(chosen)) {
    in.reading().add(entry->place, fmt::format("{}: cannot be given with {}", in.path_of(key.name), chosen));
    return false;
  }
  if (!entry && key.required && contains(key.only_with, chosen) && !misspelt) {
    in.reading().add(in.node().place, fmt::format("{}: missing, must be given with {}", in.path_of(key.name), chosen));
    return false;
  }
  if (!entry || entry->value.kind != Node::Kind::kList) {
    return true;
  }
  const auto count_given = entry->value.items.size();
  if (count_given < key.type.fewest || count_given > key.type.most) {  // has its own message
    return true;
  }
  for (const auto& [other, count] : key.items_with) {
    if (other == chosen && count_given != count) {
      return in.at(*entry).problem(fmt::format("{} values, must be {} with {}", count_given, count, chosen));
    }
  }
  return true;
}

}  // namespace

bool check_keys(const Input& in, const MapInfo& info) {
  if (in.node().kind != Node::Kind::kMap) {
    return in.must_be(info.keys.size() == 1 ? fmt::format("a map {{{}: ...}}", info.keys.front().name) : "a map");
  }
  std::set<std::string> meant;  // known keys that unknown ones were probably meant to be: not missing as well
  bool good = check_known(in, info, meant);
  std::string chosen;
  if (info.group) {
    good = check_group(in, *info.group, meant, chosen) && good;
  }
  for (const auto& key : info.keys) {
    const bool misspelt = meant.contains(key.name);
    if (!chosen.empty()) {
      good = check_beside(in, key, chosen, misspelt) && good;
    }
    if (key.required && key.only_with.empty() && !misspelt && !in.node().find(key.name)) {
      in.reading().add(in.node().place, fmt::format("{}: missing, must be given", in.path_of(key.name)));
      good = false;
    }
  }
  return good;
}

}  // namespace touchfield::schema
