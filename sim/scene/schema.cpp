#include "sim/scene/schema.h"

#include <cmath>
#include <filesystem>
#include <set>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "sim/core/renamed.h"
#include "sim/scene/yaml_tree.h"

namespace touchfield::schema {

namespace {

using Kind = TypeInfo::Kind;

// A number in the unit of the file, checked against its range; nothing after a report.
std::optional<double> checked_number(const Input& in, const TypeInfo& type) {
  const auto& node = in.node();
  const std::string noun = phrase(type, false);
  const bool plain = node.kind == Node::Kind::kScalar && !node.quoted;
  const auto value = plain ? parse_decimal(node.text) : std::nullopt;
  if (!value) {
    const bool not_finite =
        plain && std::set<std::string>{".nan", ".inf", "-.inf", "+.inf", "nan", "inf", "-inf"}.contains(node.text);
    in.must_be(not_finite ? "a finite number" : noun);
    return std::nullopt;
  }
  const bool whole = std::floor(*value) == *value;  // infinity, a text too long for a double, is stopped by the range
  if (type.kind == Kind::kInteger && !whole) {
    in.must_be(noun);
    return std::nullopt;
  }
  if (const auto rule = type.range.broken_by(*value)) {
    const std::string key = in.path().substr(in.path().rfind('.') + 1);
    in.must_be(*rule + (type.kind == Kind::kInteger ? "" : other_unit(key, *value, type.range)));
    return std::nullopt;
  }
  return value;
}

template <class T>
Codec<T> whole_number(const Range& range) {
  const TypeInfo type{.kind = Kind::kInteger, .range = range};
  return {type,
          [type](const Input& in, T& out) {
            const auto value = checked_number(in, type);
            if (value) {
              out = static_cast<T>(*value);
            }
            return value.has_value();
          },
          [](const T& value) { return scalar(std::to_string(value)); }};
}

/// What a value says as a flag; nothing if it is none.
std::optional<bool> flag_in(const Node& node) {
  const bool plain = node.kind == Node::Kind::kScalar && !node.quoted;
  if (plain && (node.text == "true" || node.text == "True" || node.text == "TRUE")) {
    return true;
  }
  if (plain && (node.text == "false" || node.text == "False" || node.text == "FALSE")) {
    return false;
  }
  return std::nullopt;
}

bool has_control_character(const std::string& text) {
  return std::any_of(text.begin(), text.end(), [](char c) {
    const auto byte = static_cast<unsigned char>(c);
    return byte < 0x20 || byte == 0x7F;
  });
}

// A scalar whose text passes a test.
Codec<std::string> tested_text(const TypeInfo& type, std::function<bool(const std::string&)> test) {
  return {type,
          [type, test = std::move(test)](const Input& in, std::string& out) {
            if (in.node().kind != Node::Kind::kScalar || !test(in.node().text)) {
              return in.must_be(phrase(type));
            }
            out = in.node().text;
            return true;
          },
          [](const std::string& value) { return scalar(value); }};
}

/// How a list is written that lacks its brackets; empty if a value looks like none.
std::string in_brackets(const Node& node) {
  constexpr std::size_t kLongest = 40;
  if (node.kind != Node::Kind::kScalar || node.text.size() > kLongest ||
      node.text.find_first_of("[]{}") != std::string::npos) {
    return "";
  }
  const std::vector<std::string_view> parts = words(node.text);
  return parts.size() > 1 ? fmt::format("; write [{}]", fmt::join(parts, ",")) : "";
}

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
    const std::string blank = missing_blank(entry.key);
    const std::string nearest = blank.empty() ? nearest_key(info, entry.key) : "";
    if (contains(names, now)) {
      meant.insert(now);
      report(fmt::format("this key is called {}", now));
    } else if (!nearest.empty()) {
      meant.insert(nearest.substr(0, nearest.find('.')));
      report(fmt::format("unknown key, did you mean {}?", nearest));
    } else if (info.keys.empty()) {
      report("unknown key, no keys are allowed here");
    } else if (!blank.empty()) {
      meant.insert(entry.key.substr(0, entry.key.find(':')));
      report("unknown key" + blank);
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

Codec<double> number(Unit unit, const Range& range) {
  const TypeInfo type{.kind = Kind::kNumber, .range = range};
  return {type,
          [type, unit](const Input& in, double& out) {
            if (!checked_number(in, type)) {
              return false;
            }
            out = *unit.si(in.node().text);
            return true;
          },
          [unit](const double& value) { return scalar(unit.text(value)); }};
}

Codec<int> integer(const Range& range) { return whole_number<int>(range); }
Codec<unsigned> seed() { return whole_number<unsigned>(between(0, std::numeric_limits<unsigned>::max())); }

bool looks_like(const TypeInfo& type, const Node& node) {
  const bool scalar = node.kind == Node::Kind::kScalar;
  switch (type.kind) {
    case Kind::kMap:
      return node.kind == Node::Kind::kMap;
    case Kind::kList:
      return node.kind == Node::Kind::kList;
    case Kind::kWord:
      return scalar && contains(type.words, node.text);
    case Kind::kFlag:
      return flag_in(node).has_value();
    case Kind::kNumber:
      return scalar && !node.quoted && parse_decimal(node.text);
    default:
      return scalar;
  }
}

Codec<bool> flag() {
  const TypeInfo type{.kind = Kind::kFlag};
  return {type,
          [type](const Input& in, bool& out) {
            const auto said = flag_in(in.node());
            if (!said) {
              return in.must_be(phrase(type));
            }
            out = *said;
            return true;
          },
          [](const bool& value) { return scalar(value ? "true" : "false"); }};
}

Codec<std::string> name() { return tested_text({.kind = Kind::kName}, is_name); }

Codec<std::string> text(std::size_t fewest_bytes) {
  return tested_text({.kind = Kind::kText, .fewest = fewest_bytes}, [fewest_bytes](const std::string& value) {
    return value.size() >= fewest_bytes && !has_control_character(value);
  });
}

Codec<std::string> file() {
  const auto named = tested_text({.kind = Kind::kFile, .fewest = 1}, [](const std::string& value) {
    return !value.empty() && !has_control_character(value);
  });
  return kept_as<std::string, std::string>(
      named,
      [](const Input& in, const std::string& path) {
        return std::optional(in.reading().resolve(in.node().place, path));
      },
      std::identity());
}

Codec<std::string> absolute_file() {
  return kept_as<std::string, std::string>(
      file(),
      [](const Input&, const std::string& path) {
        std::error_code error;
        const auto absolute = std::filesystem::absolute(path, error);
        return std::optional(error ? path : absolute.lexically_normal().string());
      },
      [](const std::string& path) { return path; });
}

Codec<std::string> word(std::vector<std::string> words) {
  const TypeInfo type{.kind = Kind::kWord, .words = std::move(words)};
  return {type,
          [type](const Input& in, std::string& out) {
            const auto& node = in.node();
            const bool is_text = node.kind == Node::Kind::kScalar;
            if (is_text && contains(type.words, node.text)) {
              out = node.text;
              return true;
            }
            const std::string nearest = is_text ? nearest_word(type.words, node.text) : "";
            return in.must_be(phrase(type) + (nearest.empty() ? "" : fmt::format("; did you mean {}?", nearest)));
          },
          [](const std::string& value) { return scalar(value); }};
}

Codec<Vector3> vector3(Unit unit, const Range& range) {
  return kept_as<Vector3, std::array<double, 3>>(
      tuple_of<double, 3>(number(unit, range)),
      [](const Input&, const std::array<double, 3>& v) {
        return std::optional<Vector3>({v[0], v[1], v[2]});
      },
      [](const Vector3& v) {
        return std::array{v.x(), v.y(), v.z()};
      });
}

Codec<Points> points(Unit unit, const Range& range) {
  return kept_as<Points, std::vector<Vector3>>(
      list_of(vector3(unit, range), 1, kMostListed),
      [](const Input&, const std::vector<Vector3>& read) {
        Points points(3, static_cast<Eigen::Index>(read.size()));
        for (std::size_t i = 0; i < read.size(); ++i) {
          points.col(static_cast<Eigen::Index>(i)) = read[i];
        }
        return std::optional<Points>(std::move(points));
      },
      [](const Points& points) {
        std::vector<Vector3> columns;
        for (Eigen::Index i = 0; i < points.cols(); ++i) {
          columns.emplace_back(points.col(i));
        }
        return columns;
      });
}

bool check_list(const Input& in, const TypeInfo& type) {
  if (in.node().kind != Node::Kind::kList) {
    return in.must_be(phrase(type, false) + in_brackets(in.node()));
  }
  const auto count = in.node().items.size();
  if (count >= type.fewest && count <= type.most) {
    return true;
  }
  std::string rule = fmt::format("{}", type.fewest);
  if (type.most == TypeInfo::kNoLimit) {
    rule = fmt::format("at least {}", type.fewest);
  } else if (type.most != type.fewest) {
    rule = fmt::format("{} to {}", type.fewest, type.most);
  }
  return in.problem(fmt::format("{} value{}, must be {}", count, count == 1 ? "" : "s", rule));
}

bool check_new_name(const Input& item, const std::string& name, const std::vector<std::string>& taken,
                    const std::string& advice) {
  const auto same = std::find(taken.begin(), taken.end(), name);
  if (same == taken.end()) {
    return true;
  }
  return item.problem(fmt::format("{} is item [{}] already, must be unique{}", name, same - taken.begin(), advice));
}

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
