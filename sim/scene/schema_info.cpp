#include "sim/scene/schema_info.h"

#include <algorithm>
#include <array>
#include <iterator>

#include <fmt/ranges.h>

namespace touchfield::schema {

namespace {

using Kind = TypeInfo::Kind;

std::string with_bounds(const std::string& noun, const Range& range, bool with_range) {
  const std::string bounds = range.text();
  if (!with_range || bounds.empty()) {
    return noun;
  }
  const bool comparison = bounds.front() == '>' || bounds.front() == '<';
  return fmt::format("{}{} {}", noun, comparison ? "" : " from", bounds);
}

std::string plural_phrase(const TypeInfo& type, bool with_range) {
  switch (type.kind) {
    case Kind::kNumber:
      return with_bounds("numbers", type.range, with_range);
    case Kind::kInteger:
      return with_bounds("whole numbers", type.range, with_range);
    case Kind::kMap:
      return "maps";
    case Kind::kList:
      return fmt::format("lists of {} {}", type.fewest, plural_phrase(type.of.front(), with_range));
    default:
      return "items, each " + phrase(type, with_range);
  }
}

std::string list_phrase(const TypeInfo& type, bool with_range) {
  std::string count;
  if (type.fewest == type.most) {
    count = fmt::format("{} ", type.fewest);
  } else if (type.most != TypeInfo::kNoLimit && !type.distinct) {
    count = fmt::format("{} to {} ", type.fewest, type.most);
  } else if (type.fewest > 1) {
    count = fmt::format("at least {} ", type.fewest);
  }
  const std::string what = type.distinct ? fmt::format("different words of {}", fmt::join(type.of.front().words, ", "))
                                         : plural_phrase(type.of.front(), with_range);
  return fmt::format("a list of {}{}", count, what);
}

/// The type itself, or the first of its alternatives, that is of this kind; null if there is none.
const TypeInfo* of_kind(const TypeInfo& type, TypeInfo::Kind kind) {
  if (type.kind != Kind::kAny) {
    return type.kind == kind ? &type : nullptr;
  }
  for (const TypeInfo& alternative : type.of) {
    if (const TypeInfo* found = of_kind(alternative, kind)) {
      return found;
    }
  }
  return nullptr;
}

/// The key of a map of this type; null if the type is no map or knows no such key.
const KeyInfo* known_key(const TypeInfo& type, std::string_view name) {
  const TypeInfo* map = of_kind(type, Kind::kMap);
  if (map == nullptr) {
    return nullptr;
  }
  const auto found = std::ranges::find(map->map->keys, name, &KeyInfo::name);
  return found == map->map->keys.end() ? nullptr : &*found;
}

/// The key of the group that stands beside this one in an example: the first that may; empty without a group.
std::string chosen_with(const MapInfo& info, const KeyInfo& key) {
  if (!info.group || contains(info.group->keys, key.name)) {
    return info.group ? key.name : "";
  }
  return key.fits(info.group->keys.front()) ? info.group->keys.front() : key.only_with.front();
}

Node example_of_type(const TypeInfo& type) {
  if (type.kind == TypeInfo::Kind::kList) {
    return list(std::vector<Node>(std::max<std::size_t>(type.fewest, 1), example_of_type(type.of.front())));
  }
  const TypeInfo* found = of_kind(type, TypeInfo::Kind::kMap);
  if (found == nullptr || found->map->keys.empty()) {
    return found == nullptr ? Node{} : map({});
  }
  const MapInfo& info = *found->map;
  const KeyInfo& key = info.group ? *known_key(*found, info.group->keys.front()) : info.keys.front();
  return example_with(info, key.name, example_of(key));
}

// Longest first where one ends in another.
constexpr std::array kUnits = {"_percent", "_kg_m3", "_g_cm3", "_mm_s", "_pa_m", "_kpa", "_khz", "_mhz", "_deg",
                               "_rad",     "_m_s",   "_hz",    "_pa",   "_db",   "_mm",  "_cm",  "_um",  "_km",
                               "_in",      "_ms",    "_m",     "_c",    "_k",    "_f",   "_s"};

// Names of a position, one of which a map knows.
constexpr std::array<std::string_view, 5> kPositions = {"at", "centre", "center", "position", "through"};

constexpr std::size_t kLongestTried = 64;  // no known word is near a longer one

std::string folded(std::string_view key) {
  std::string result(key);
  for (char& c : result) {
    if (c >= 'A' && c <= 'Z') {
      c = static_cast<char>(c - 'A' + 'a');
    }
    if (c == '-' || c == ' ') {
      c = '_';
    }
  }
  return result;
}

/// The word of least distance from a text, the first of several; empty if none is near.
template <class Distance>
std::string nearest(const std::vector<std::string>& words, std::string_view text, const Distance& distance) {
  if (text.size() > kLongestTried) {
    return {};
  }
  const std::string typed = folded(text);
  std::string best;
  std::size_t best_distance = TypeInfo::kNoLimit;
  for (const auto& word : words) {
    const std::size_t from_word = distance(word, typed);
    if (from_word <= std::max<std::size_t>(1, std::min(word.size(), typed.size()) / 3) && from_word < best_distance) {
      best = word;
      best_distance = from_word;
    }
  }
  return best;
}

}  // namespace

bool KeyInfo::fits(const std::string& chosen) const {
  return only_with.empty() || contains(only_with, chosen) || contains(also_with, chosen);
}

std::vector<std::string> MapInfo::names() const {
  std::vector<std::string> names;
  std::ranges::transform(keys, std::back_inserter(names), &KeyInfo::name);
  return names;
}

bool contains(const std::vector<std::string>& list, const std::string& item) {
  return std::ranges::find(list, item) != list.end();
}

bool is_name(const std::string& text) {
  const auto allowed = [](char c) {
    return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_' || c == '-';
  };
  return !text.empty() && text.size() <= kLongestName && std::all_of(text.begin(), text.end(), allowed);
}

std::string phrase(const TypeInfo& type, bool with_range) {
  switch (type.kind) {
    case Kind::kNumber:
      return with_bounds("a number", type.range, with_range);
    case Kind::kInteger:
      return with_bounds("a whole number", type.range, with_range);
    case Kind::kFlag:
      return "true or false";
    case Kind::kWord:
      return type.words.size() == 1 ? type.words.front() : fmt::format("one of {}", fmt::join(type.words, ", "));
    case Kind::kName:
      return fmt::format("1 to {} letters, digits, _ or -", kLongestName);
    case Kind::kText:
      return type.fewest > 0 ? "a text that is not empty" : "a text";
    case Kind::kFile:
      return "the name of a file";
    case Kind::kList:
      return list_phrase(type, with_range);
    case Kind::kMap:
      return type.map->keys.size() == 1 ? fmt::format("a map {{{}: ...}}", type.map->keys.front().name) : "a map";
    case Kind::kTable:
      return fmt::format("a map of names to {}", plural_phrase(type.of.front(), with_range));
    case Kind::kAny: {
      std::vector<std::string> parts;
      for (const auto& part : type.of) {
        parts.push_back(phrase(part, with_range));
      }
      return fmt::format("{}", fmt::join(parts, " or "));
    }
  }
  return "";
}

Node example_of(const KeyInfo& key) {
  if (!key.example.empty()) {
    return parse_yaml(key.example, 0);
  }
  const bool has_default = !key.fallback.empty() && key.fallback != "[]" && key.type.kind != TypeInfo::Kind::kMap;
  return has_default ? parse_yaml(key.fallback, 0) : example_of_type(key.type);
}

Node example_with(const MapInfo& info, const std::string& name, const Node& value) {
  const std::string chosen = chosen_with(info, *std::ranges::find(info.keys, name, &KeyInfo::name));
  std::vector<std::pair<std::string, Node>> entries;
  for (const KeyInfo& key : info.keys) {
    const bool needed = key.required && (key.only_with.empty() || contains(key.only_with, chosen));
    if (key.name != name && key.name != chosen && !needed) {
      continue;
    }
    Node node = key.name == name ? value : example_of(key);
    for (const auto& [other, count] : key.items_with) {
      if (other == chosen && !node.items.empty()) {
        node.items.resize(count, Node(node.items.back()));
      }
    }
    entries.emplace_back(key.name, std::move(node));
  }
  return map(std::move(entries));
}

std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::vector<std::size_t>> d(a.size() + 1, std::vector<std::size_t>(b.size() + 1));
  for (std::size_t i = 0; i <= a.size(); ++i) {
    d[i][0] = i;
  }
  for (std::size_t j = 0; j <= b.size(); ++j) {
    d[0][j] = j;
  }
  for (std::size_t i = 1; i <= a.size(); ++i) {
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t replaced = d[i - 1][j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1);
      d[i][j] = std::min({d[i - 1][j] + 1, d[i][j - 1] + 1, replaced});
      const bool swapped = i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1];
      if (swapped) {
        d[i][j] = std::min(d[i][j], d[i - 2][j - 2] + 1);
      }
    }
  }
  return d[a.size()][b.size()];
}

std::string_view without_unit(std::string_view key) {
  for (const std::string_view unit : kUnits) {
    if (key.size() > unit.size() && key.ends_with(unit)) {
      return key.substr(0, key.size() - unit.size());
    }
  }
  return key;
}

std::string nearest_word(const std::vector<std::string>& words, std::string_view text) {
  return nearest(words, text, edit_distance);
}

std::string nearest_key(const MapInfo& map, std::string_view unknown) {
  const auto is_position = [](std::string_view key) {
    const std::string_view name = without_unit(key);
    return name.size() < key.size() && std::ranges::find(kPositions, name) != kPositions.end();
  };
  if (const auto position = std::ranges::find_if(map.keys, is_position, &KeyInfo::name);
      is_position(unknown) && position != map.keys.end()) {
    return position->name;
  }
  // A wrong unit is many letters away but the commonest slip.
  const auto distance = [](std::string_view known, std::string_view typed) {
    return without_unit(known) == without_unit(typed) ? 0 : edit_distance(known, typed);
  };
  if (std::string best = nearest(map.names(), unknown, distance); !best.empty() || unknown.size() > kLongestTried) {
    return best;
  }
  const std::string key = folded(unknown);
  for (const auto& known : map.keys) {
    if (!known.type.map) {
      continue;
    }
    for (const auto& below : known.type.map->keys) {
      if (below.name == key) {
        return known.name + "." + below.name;
      }
    }
  }
  return {};
}

}  // namespace touchfield::schema
