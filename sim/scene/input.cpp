#include "sim/scene/input.h"

#include <algorithm>
#include <filesystem>
#include <utility>

#include <fmt/format.h>

#include "sim/core/renamed.h"
#include "sim/core/text.h"

namespace touchfield::schema {

namespace {

constexpr std::size_t kMostProblems = 100;

std::string description(const Node& node) {
  switch (node.kind) {
    case Node::Kind::kNull:
      return "no value";
    case Node::Kind::kScalar:
      return quoted_for_message(node.text);
    case Node::Kind::kList:
      return "a list";
    case Node::Kind::kMap:
      return "a map";
  }
  return "";
}

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

Reading::Reading(std::string file, std::vector<std::string> overrides)
    : file_(std::move(file)),
      overrides_(std::move(overrides)),
      folder_(std::filesystem::path(file_).parent_path().string()) {}

Reading::Reading(std::string name, std::vector<std::string> overrides, std::string folder, std::string changes)
    : file_(std::move(name)),
      overrides_(std::move(overrides)),
      folder_(std::move(folder)),
      override_folder_(folder_),
      changes_(std::move(changes)) {}

std::string Reading::placed(const Place& place, const std::string& text) const {
  if (place.source > 0) {
    const std::string& change = overrides_.at(static_cast<std::size_t>(place.source) - 1);
    return fmt::format("{} {}: {}", changes_, quoted_for_message(change, 100), text);
  }
  return file_.empty() ? text : fmt::format("{}:{}:{}: {}", file_, place.line, place.column, text);
}

void Reading::add(const Place& place, const std::string& text) { problems_.push_back({place, placed(place, text)}); }

std::string Reading::message() const {
  auto problems = problems_;
  std::stable_sort(problems.begin(), problems.end(),
                   [](const Problem& a, const Problem& b) { return a.place < b.place; });
  std::string message;
  for (std::size_t i = 0; i < std::min(problems.size(), kMostProblems); ++i) {
    message += (i == 0 ? "" : "\n") + problems[i].text;
  }
  if (problems.size() > kMostProblems) {
    message +=
        fmt::format("\n{}and {} problems more", file_.empty() ? "" : file_ + ": ", problems.size() - kMostProblems);
  }
  return message;
}

std::string Reading::resolve(const Place& place, const std::string& name) const {
  const std::filesystem::path folder = place.source == 0 ? folder_ : override_folder_;
  return (folder / name).lexically_normal().string();
}

Input::Input(const Node& node, std::string path, Reading& reading)
    : node_(&node), path_(std::move(path)), reading_(&reading) {}

Input Input::at(std::size_t item) const { return {node_->items[item], fmt::format("{}[{}]", path_, item), *reading_}; }

std::string Input::path_of(const std::string& key) const {
  const std::string name = quoted_for_message(key);
  return path_.empty() ? name : path_ + "." + name;
}

bool Input::must_be(const std::string& rule) const {
  const std::string shown = description(*node_);
  if (node_->kind != Node::Kind::kScalar) {
    return problem(fmt::format("{}, must be {}", shown, rule));
  }
  if (node_->quoted) {
    return problem(fmt::format("the text \"{}\" must be {}", shown, rule));
  }
  reading_->add(node_->place, fmt::format("{} = {} must be {}{}", path_, shown, rule, missing_blank(node_->text)));
  return false;
}

bool Input::problem(const std::string& text) const {
  reading_->add(node_->place, path_.empty() ? text : fmt::format("{}: {}", path_, text));
  return false;
}

std::string quoted_for_message(const std::string& text, std::size_t longest) {
  std::string shown = text;
  if (shown.size() > longest) {
    std::size_t cut = longest;
    while (cut > 0 && (static_cast<unsigned char>(shown[cut]) & 0xC0U) == 0x80U) {  // not within a UTF-8 character
      --cut;
    }
    shown.resize(cut);
    shown += "...";
  }
  std::ranges::replace_if(
      shown, [](unsigned char byte) { return byte < 0x20 || byte == 0x7F; }, ' ');
  return shown;
}

Node read_map(const std::string& text, std::string_view what, Reading& reading) {
  require_text(text, reading.file());
  try {
    Node root = parse_yaml(text, 0);
    if (root.kind == Node::Kind::kMap) {
      return root;
    }
    const bool empty = root.kind == Node::Kind::kNull;
    reading.add(empty ? Place{} : root.place,
                fmt::format("{}, {} must be a map of keys", empty ? "empty" : "not a map", what));
  } catch (const SyntaxError& error) {
    reading.add(error.place, error.what);
  }
  throw InputError(reading.message());
}

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
