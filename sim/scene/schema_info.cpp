#include "sim/scene/schema_info.h"

#include <algorithm>
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

const KeyInfo* known_key(const TypeInfo& type, std::string_view name) {
  const TypeInfo* map = of_kind(type, Kind::kMap);
  if (map == nullptr) {
    return nullptr;
  }
  const auto found = std::ranges::find(map->map->keys, name, &KeyInfo::name);
  return found == map->map->keys.end() ? nullptr : &*found;
}

}  // namespace touchfield::schema
