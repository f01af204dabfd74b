#include "sim/scene/overrides.h"

#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "sim/core/renamed.h"
#include "sim/core/text.h"

namespace touchfield::schema {

namespace {

struct Problem {
  std::string text;
};

/// Puts a value where a path leads; what is not there on the way becomes a map. Throws Problem if it leads nowhere.
void put(Node& root, const std::vector<std::string>& path, Node value, const Place& place) {
  Node* at = &root;
  std::string name;
  for (const std::string& part : path) {
    const bool last = &part == &path.back();
    const std::string outer = std::exchange(name, name.empty() ? part : name + "." + part);
    const std::string owner = outer.empty() ? "the scene" : outer;
    const auto number = number_of<std::size_t>(part);
    if (at->kind == Node::Kind::kList) {
      if (last && value.removed) {
        throw Problem{fmt::format("{}: null removes keys, not items of a list", name)};
      }
      if (!number || *number >= at->items.size()) {
        throw Problem{fmt::format("{} names no item of {}, which has {}", name, outer, at->items.size())};
      }
      at = &at->items[*number];
      continue;
    }
    if (at->kind != Node::Kind::kMap) {
      const std::string what = at->kind == Node::Kind::kNull ? "no value" : quoted_for_message(at->text);
      throw Problem{fmt::format("{} is {}, not a map or list", owner, what)};
    }
    Entry* entry = at->find_even_removed(part);
    const bool is_new = entry == nullptr || entry->value.removed;
    if (is_new && value.removed && !last) {
      const std::string now = new_name(NameOf::kKey, part);
      throw Problem{now.empty() ? fmt::format("{} is not in the scene, nothing to remove", name)
                                : fmt::format("{}: this key is called {}", name, now)};
    }
    // A number in the path of something that is not a list would silently become a key.
    if (number && (is_new || last)) {
      throw Problem{fmt::format("{} is not a list in the scene, give it as a whole", owner)};
    }
    if (entry == nullptr) {
      at->entries.push_back({part, place, {}});
      entry = &at->entries.back();
    }
    if (is_new) {
      entry->value = map({});
      entry->value.place = place;
    }
    if (is_new || last) {
      entry->place = place;
    }
    at = &entry->value;
  }
  *at = std::move(value);
}

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
    put(changed, *path, std::move(value), place);
    root = std::move(changed);
  } catch (const Problem& problem) {
    reading.add(place, problem.text);
  } catch (const SyntaxError& error) {
    reading.add(place, error.what);
  }
}

}  // namespace touchfield::schema
