#include "sim/jobs/scene_changes.h"

#include <map>
#include <utility>

#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/scene/yaml_tree.h"

namespace touchfield {

namespace {

using KeyTexts = std::vector<std::pair<std::string, std::string>>;  // by path, in the order of the scene

void add_keys(const std::string& path, const schema::Node& node, KeyTexts& keys) {
  for (const schema::Entry& entry : node.entries) {
    add_keys(path.empty() ? entry.key : path + '.' + entry.key, entry.value, keys);
  }
  for (std::size_t i = 0; i < node.items.size(); ++i) {
    add_keys(fmt::format("{}[{}]", path, i), node.items[i], keys);
  }
  if (node.entries.empty() && node.items.empty()) {
    keys.emplace_back(path, flow_text(node));
  }
}

KeyTexts keys_of(const std::string& text, char run) {
  KeyTexts keys;
  try {
    add_keys("", schema::parse_yaml(text, 0), keys);
  } catch (const schema::SyntaxError& error) {
    throw InputError(fmt::format("the scene that {} holds cannot be read: line {}, column {}: {}", run,
                                 error.place.line, error.place.column, error.what));
  }
  return keys;
}

}  // namespace

std::vector<SceneKeyChange> scene_changes(const std::string& a, const std::string& b) {
  const KeyTexts keys_a = keys_of(a, 'A');
  const KeyTexts keys_b = keys_of(b, 'B');
  const std::map<std::string, std::string> by_path_a(keys_a.begin(), keys_a.end());
  const std::map<std::string, std::string> by_path_b(keys_b.begin(), keys_b.end());
  std::vector<SceneKeyChange> changes;
  for (const auto& [path, text] : keys_a) {
    const auto other = by_path_b.find(path);
    if (other == by_path_b.end()) {
      changes.push_back({path, text, std::nullopt});
    } else if (other->second != text) {
      changes.push_back({path, text, other->second});
    }
  }
  for (const auto& [path, text] : keys_b) {
    if (!by_path_a.contains(path)) {
      changes.push_back({path, std::nullopt, text});
    }
  }
  return changes;
}

}  // namespace touchfield
