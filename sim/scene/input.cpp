#include "sim/scene/input.h"

#include <algorithm>
#include <filesystem>
#include <utility>

#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/core/text.h"
#include "sim/scene/text_file.h"

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

std::string Reading::place_text(const Place& place) const {
  return place.source == 0
             ? fmt::format("{}:{}:{}", file_, place.line, place.column)
             : fmt::format("{} {}", changes_,
                           quoted_for_message(overrides_.at(static_cast<std::size_t>(place.source) - 1), 100));
}

void Reading::add(const Place& place, std::string text) {
  problems_.push_back({place, fmt::format("{}: {}", place_text(place), text)});
}

std::string Reading::message() const {
  auto problems = problems_;
  std::stable_sort(problems.begin(), problems.end(),
                   [](const Problem& a, const Problem& b) { return a.place < b.place; });
  std::string message;
  for (std::size_t i = 0; i < std::min(problems.size(), kMostProblems); ++i) {
    message += (i == 0 ? "" : "\n") + problems[i].text;
  }
  if (problems.size() > kMostProblems) {
    message += fmt::format("\n{}: and {} problems more", file_, problems.size() - kMostProblems);
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
  reading_->add(node_->place, fmt::format("{} = {} must be {}", path_, shown, rule));
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

}  // namespace touchfield::schema
