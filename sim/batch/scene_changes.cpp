#include "sim/batch/scene_changes.h"

#include <algorithm>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/scene/random_range.h"
#include "sim/scene/scene_table.h"
#include "sim/scene/yaml_tree.h"

namespace touchfield {

namespace {

using schema::Entry;
using schema::KeyInfo;
using schema::Node;
using schema::TypeInfo;

Node tree_of(const std::string& text, char run) {
  try {
    return schema::parse_yaml(text, 0);
  } catch (const schema::SyntaxError& error) {
    throw InputError(fmt::format("the scene that {} holds cannot be read: line {}, column {}: {}", run,
                                 error.place.line, error.place.column, error.what));
  }
}

bool same_scalar(const Node& a, const Node& b) {
  const auto number_a = schema::number_in(a);
  const auto number_b = schema::number_in(b);
  return number_a && number_b ? *number_a == *number_b : a.text == b.text && !number_a == !number_b;
}

class Comparison {
 public:
  /// type   what the table says of both values; null if it knows nothing of them
  void compare(const std::string& path, const TypeInfo* type, const Node& a, const Node& b) {
    if (a.kind == Node::Kind::kMap && b.kind == Node::Kind::kMap && are_one_thing(a, b)) {
      compare_maps(path, type, a, b);
    } else if (a.kind == Node::Kind::kList && b.kind == Node::Kind::kList) {
      compare_lists(path, of_kind(type, TypeInfo::Kind::kList), a.items, b.items);
    } else if (a.kind != b.kind || a.kind == Node::Kind::kMap ||
               (a.kind == Node::Kind::kScalar && !same_scalar(a, b))) {
      difference_.changes.push_back({path, flow_text(a), flow_text(b)});
    }
  }

  SceneDifference take() { return std::move(difference_); }

 private:
  static const TypeInfo* of_kind(const TypeInfo* type, TypeInfo::Kind kind) {
    return type == nullptr ? nullptr : schema::of_kind(*type, kind);
  }

  static bool equal(const TypeInfo* type, const Node& a, const Node& b) {
    Comparison comparison;
    comparison.compare("", type, a, b);
    return comparison.difference_.changes.empty();
  }

  /// Maps that share no key are two things, not one that has changed: {sphere: ...} and {hand: ...}.
  static bool are_one_thing(const Node& a, const Node& b) {
    return a.entries.empty() || b.entries.empty() ||
           std::ranges::any_of(a.entries, [&](const Entry& entry) { return b.find(entry.key) != nullptr; });
  }

  static std::string joined(const std::string& path, const std::string& key) {
    return path.empty() ? key : path + '.' + key;
  }

  /// An entry of one scene alone, beside what the other means without it.
  void add_unshared(const std::string& path, const KeyInfo* key, const Node& value, bool in_a) {
    const std::string meant = key == nullptr ? "" : key->fallback;
    std::optional<std::string> other;
    if (!meant.empty()) {
      const Node absent = schema::parse_yaml(meant, 0);
      if (equal(&key->type, absent, value)) {
        (in_a ? difference_.at_defaults.a : difference_.at_defaults.b).push_back(path);
        return;
      }
      other = flow_text(absent);
    }
    difference_.changes.push_back(in_a ? TextChange{path, flow_text(value), other}
                                       : TextChange{path, other, flow_text(value)});
  }

  void compare_maps(const std::string& path, const TypeInfo* type, const Node& a, const Node& b) {
    const auto key_of = [&](const Entry& entry) {
      return type == nullptr ? nullptr : schema::known_key(*type, entry.key);
    };
    for (const Entry& entry : a.entries) {
      const KeyInfo* key = key_of(entry);
      if (const Entry* other = b.find(entry.key)) {
        compare(joined(path, entry.key), key == nullptr ? nullptr : &key->type, entry.value, other->value);
      } else {
        add_unshared(joined(path, entry.key), key, entry.value, true);
      }
    }
    for (const Entry& entry : b.entries) {
      if (a.find(entry.key) == nullptr) {
        add_unshared(joined(path, entry.key), key_of(entry), entry.value, false);
      }
    }
  }

  void compare_lists(const std::string& path, const TypeInfo* type, const std::vector<Node>& a,
                     const std::vector<Node>& b) {
    const TypeInfo* item = type == nullptr ? nullptr : &type->of.front();
    const std::size_t shorter = std::min(a.size(), b.size());
    std::size_t front = 0;
    std::size_t back = 0;
    if (a.size() != b.size()) {
      while (front < shorter && equal(item, a[front], b[front])) {
        ++front;
      }
      while (back < shorter - front && equal(item, a[a.size() - 1 - back], b[b.size() - 1 - back])) {
        ++back;
      }
    }
    const auto at = [&](std::size_t i) { return fmt::format("{}[{}]", path, i); };
    for (std::size_t i = front; i < std::max(a.size(), b.size()) - back; ++i) {
      if (i + back >= a.size()) {
        difference_.changes.push_back({at(i), std::nullopt, flow_text(b[i])});
      } else if (i + back >= b.size()) {
        difference_.changes.push_back({at(i), flow_text(a[i]), std::nullopt});
      } else {
        compare(at(i), item, a[i], b[i]);
      }
    }
  }

  SceneDifference difference_;
};

}  // namespace

SceneDifference scene_changes(const std::string& a, const std::string& b) {
  if (a == b) {
    return {};
  }
  Comparison comparison;
  comparison.compare("", &schema::scene_codec().type, tree_of(a, 'A'), tree_of(b, 'B'));
  return comparison.take();
}

}  // namespace touchfield
