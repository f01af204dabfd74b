#include "sim/scene/schema.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>
#include <set>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "sim/scene/schema_info.h"
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
    in.must_be(*rule);
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

namespace {

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

}  // namespace

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

}  // namespace touchfield::schema
