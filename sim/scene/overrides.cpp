#include "sim/scene/overrides.h"

#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "sim/core/text_number.h"

namespace touchfield::schema {

namespace {

Node empty_map(const Place& place) {
  Node node = map({});
  node.place = place;
  return node;
}

struct Problem {
  std::string text;
};

// Walks a path through a scene and changes what it finds there. Throws Problem where it leads nowhere.
class Walk {
 public:
  Walk(Node& root, Place place) : at_(&root), place_(place) {}

  /// One part further down; a key that is not there becomes an empty map.
  void step(const std::string& part, bool make) {
    if (at_->kind == Node::Kind::kList) {
      at_ = &item(part);
    } else {
      require_map();
      Entry* entry = at_->find_even_removed(part);
      if (!entry || entry->value.removed) {
        if (!make) {
          throw Problem{fmt::format("{} is not in the scene, nothing to remove", name_of(part))};
        }
        put(part, empty_map(place_));
        entry = at_->find_even_removed(part);
      }
      at_ = &entry->value;
    }
    path_ = name_of(part);
  }

  /// Sets what the last part names.
  void set(const std::string& part, Node value) {
    if (at_->kind == Node::Kind::kList) {
      if (value.removed) {
        throw Problem{fmt::format("{}: null removes keys, not items of a list", name_of(part))};
      }
      item(part) = std::move(value);
      return;
    }
    require_map();
    put(part, std::move(value));
  }

 private:
  std::string name_of(const std::string& part) const { return path_.empty() ? part : path_ + "." + part; }

  Node& item(const std::string& part) {
    const auto number = number_of<std::size_t>(part);
    const auto count = at_->items.size();
    if (!number || *number >= count) {
      throw Problem{fmt::format("{} names no item of {}, which has {}", name_of(part), path_, count)};
    }
    return at_->items[*number];
  }

  // A number in the path of something that is not a list would silently become a key.
  void require_map() const {
    if (at_->kind == Node::Kind::kMap) {
      return;
    }
    const std::string what = at_->kind == Node::Kind::kNull ? "no value" : quoted_for_message(at_->text);
    throw Problem{fmt::format("{} is {}, not a map or list", path_.empty() ? "the scene" : path_, what)};
  }

  void put(const std::string& part, Node value) {
    if (number_of<std::size_t>(part)) {
      throw Problem{
          fmt::format("{} is not a list in the scene, give it as a whole", path_.empty() ? "the scene" : path_)};
    }
    if (Entry* entry = at_->find_even_removed(part)) {
      entry->value = std::move(value);
      entry->place = place_;
    } else {
      at_->entries.push_back({part, place_, std::move(value)});
    }
  }

  Node* at_;
  Place place_;
  std::string path_;
};

}  // namespace

std::optional<std::vector<std::string>> split_path(const std::string& path) {
  std::vector<std::string> parts(1);
  bool closed = false;  // after "]" only "." or "[" may follow
  for (std::size_t i = 0; i < path.size(); ++i) {
    const char c = path[i];
    if (c == '.') {
      parts.emplace_back();
      closed = false;
    } else if (c == '[') {
      const auto end = path.find(']', i);
      if (end == std::string::npos) {
        return std::nullopt;
      }
      parts.push_back(path.substr(i + 1, end - i - 1));
      i = end;
      closed = true;
    } else if (c == ']' || closed) {
      return std::nullopt;
    } else {
      parts.back() += c;
    }
  }
  if (std::any_of(parts.begin(), parts.end(), [](const std::string& part) { return part.empty(); })) {
    return std::nullopt;
  }
  return parts;
}

void apply_override(Node& root, const std::string& text, int source, Reading& reading) {
  const Place place{source, 1, 1};
  const auto equals = text.find('=');
  const auto path = equals == std::string::npos ? std::nullopt : split_path(text.substr(0, equals));
  if (!path) {
    reading.add(place, "must be key.path=value");
    return;
  }
  try {
    Node value = parse_yaml(text.substr(equals + 1), source);
    const bool written = text.find_first_not_of(" \t", equals + 1) != std::string::npos;
    if (!written) {
      throw Problem{"no value; null removes a key"};
    }
    value.removed = value.kind == Node::Kind::kNull;
    Node changed = root;  // a path that leads nowhere leaves no maps behind
    Walk walk(changed, place);
    for (std::size_t i = 0; i + 1 < path->size(); ++i) {
      walk.step((*path)[i], !value.removed);
    }
    walk.set(path->back(), std::move(value));
    root = std::move(changed);
  } catch (const Problem& problem) {
    reading.add(place, problem.text);
  } catch (const SyntaxError& error) {
    reading.add(place, error.what);
  }
}

}  // namespace touchfield::schema
