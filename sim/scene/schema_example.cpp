#include "sim/scene/schema_example.h"

#include <algorithm>

namespace touchfield::schema {

namespace {

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

}  // namespace

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

}  // namespace touchfield::schema
