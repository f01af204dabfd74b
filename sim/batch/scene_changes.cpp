#include "sim/batch/scene_changes.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/scene/random_range.h"
#include "sim/scene/yaml_tree.h"

namespace touchfield {

namespace {

using schema::Entry;
using schema::Node;

Node tree_of(const std::string& text, char run) {
  try {
    return schema::parse_yaml(text, 0);
  } catch (const schema::SyntaxError& error) {
    throw InputError(fmt::format("the scene that {} holds cannot be read: line {}, column {}: {}", run,
                                 error.place.line, error.place.column, error.what));
  }
}

bool same(const Node& a, const Node& b);

bool same_scalar(const Node& a, const Node& b) {
  const auto number_a = schema::number_in(a);
  const auto number_b = schema::number_in(b);
  return number_a && number_b ? *number_a == *number_b : a.text == b.text && !number_a == !number_b;
}

bool same_entries(const std::vector<Entry>& a, const Node& b) {
  return std::ranges::all_of(a, [&](const Entry& entry) {
    const Entry* other = b.find(entry.key);
    return other != nullptr && same(entry.value, other->value);
  });
}

bool same(const Node& a, const Node& b) {
  if (a.kind != b.kind) {
    return false;
  }
  switch (a.kind) {
    case Node::Kind::kNull:
      return true;
    case Node::Kind::kScalar:
      return same_scalar(a, b);
    case Node::Kind::kList:
      return std::ranges::equal(a.items, b.items, same);
    case Node::Kind::kMap:
      return a.entries.size() == b.entries.size() && same_entries(a.entries, b);
  }
  return false;
}

class Comparison {
 public:
  void compare(const std::string& path, const Node& a, const Node& b) {
    if (a.kind == Node::Kind::kMap && b.kind == Node::Kind::kMap && share_a_key(a, b)) {
      compare_maps(path, a, b);
    } else if (a.kind == Node::Kind::kList && b.kind == Node::Kind::kList) {
      compare_lists(path, a.items, b.items);
    } else if (!same(a, b)) {
      changes_.push_back({path, flow_text(a), flow_text(b)});
    }
  }

  std::vector<TextChange> take() { return std::move(changes_); }

 private:
  /// Maps that share none are two things, not one that has changed: {sphere: ...} and {hand: ...}.
  static bool share_a_key(const Node& a, const Node& b) {
    return std::ranges::any_of(a.entries, [&](const Entry& entry) { return b.find(entry.key) != nullptr; });
  }

  static std::string joined(const std::string& path, const std::string& key) {
    return path.empty() ? key : path + '.' + key;
  }

  void compare_maps(const std::string& path, const Node& a, const Node& b) {
    for (const Entry& entry : a.entries) {
      if (const Entry* other = b.find(entry.key)) {
        compare(joined(path, entry.key), entry.value, other->value);
      } else {
        changes_.push_back({joined(path, entry.key), flow_text(entry.value), std::nullopt});
      }
    }
    for (const Entry& entry : b.entries) {
      if (a.find(entry.key) == nullptr) {
        changes_.push_back({joined(path, entry.key), std::nullopt, flow_text(entry.value)});
      }
    }
  }

  void compare_lists(const std::string& path, const std::vector<Node>& a, const std::vector<Node>& b) {
    const std::size_t shorter = std::min(a.size(), b.size());
    std::size_t front = 0;
    std::size_t back = 0;
    if (a.size() != b.size()) {
      while (front < shorter && same(a[front], b[front])) {
        ++front;
      }
      while (back < shorter - front && same(a[a.size() - 1 - back], b[b.size() - 1 - back])) {
        ++back;
      }
    }
    const auto at = [&](std::size_t i) { return fmt::format("{}[{}]", path, i); };
    for (std::size_t i = front; i < std::max(a.size(), b.size()) - back; ++i) {
      if (i + back >= a.size()) {
        changes_.push_back({at(i), std::nullopt, flow_text(b[i])});
      } else if (i + back >= b.size()) {
        changes_.push_back({at(i), flow_text(a[i]), std::nullopt});
      } else {
        compare(at(i), a[i], b[i]);
      }
    }
  }

  std::vector<TextChange> changes_;
};

}  // namespace

std::vector<TextChange> scene_changes(const std::string& a, const std::string& b) {
  if (a == b) {
    return {};
  }
  Comparison comparison;
  comparison.compare("", tree_of(a, 'A'), tree_of(b, 'B'));
  return comparison.take();
}

}  // namespace touchfield
