#include "sim/scene/input.h"

#include <algorithm>
#include <filesystem>
#include <utility>

#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/core/file_kind.h"
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

/// What a byte that is no character may come from.
std::string remedy_of(unsigned char byte) {
  return byte == 0 ? ": a zero byte" : byte >= 0x80 ? ": save the file as UTF-8" : "";
}

/// Says what the parser's words leave out: a tab or an odd blank that indents, or the lines whose indentation to look
/// at.
void explain(const std::string& text, SyntaxError& error) {
  int above = 0;  // the last line that is not empty before the fault's
  bool tab = false;
  std::string odd;
  for_each_text_line(text, [&](int line, std::string_view content) {
    const std::size_t first = content.find_first_not_of(' ');
    if (line < error.place.line && first != std::string_view::npos && content[first] != '#') {
      above = line;
      const std::string found = odd_character(content.substr(line == 1 && content.starts_with(kByteOrderMark) ? 3 : 0));
      odd = found.empty() ? std::string() : fmt::format("; in line {} there is a {}", line, found);
    } else if (line == error.place.line && first != std::string_view::npos && content[first] == '\t') {
      error.place.column = static_cast<int>(first) + 1;
      tab = true;
    }
  });
  if (tab) {
    error.what = "not YAML: indented by a tab, must be spaces";
  } else if (error.of_layout && above > 0) {
    error.what += fmt::format("; check the indentation of lines {} to {}", above, error.place.line);
  }
  error.what += odd;
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
  std::string odd;
  if (place.source > 0) {
    odd = odd_character(overrides_.at(static_cast<std::size_t>(place.source) - 1));
  } else if (const auto found = odd_.find(place.line); found != odd_.end()) {
    odd = found->second;
  }
  problems_.push_back(
      {place, fmt::format("{}: {}{}", place_text(place), text, odd.empty() ? "" : "; there is a " + odd)});
}

void Reading::watch(std::string_view text) {
  for_each_text_line(text, [&](int line, std::string_view content) {
    content.remove_prefix(line == 1 && content.starts_with(kByteOrderMark) ? 3 : 0);
    if (const std::string odd = odd_character(content); !odd.empty()) {
      odd_.emplace(line, odd);
    }
  });
}

void Reading::add_elsewhere(const Place& place, std::string text) { problems_.push_back({place, std::move(text)}); }

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
  for (char& c : shown) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte == '\n' || byte == '\r' || byte == '\t') {
      c = ' ';
    } else if (byte < 0x20 || byte == 0x7F)
      c = '?';
  }
  return shown;
}

Node read_map(const std::string& text, std::string_view what, Reading& reading) {
  if (const auto kind = foreign_kind(text)) {
    reading.add({}, "this is " + *kind);
    throw InputError(reading.message());
  }
  const auto fault = find_text_fault(text);
  if (fault.column > 0) {
    reading.add({0, fault.line, fault.column}, "not a character of UTF-8 text" + remedy_of(fault.byte));
    throw InputError(reading.message());
  }
  reading.watch(text);
  try {
    Node root = parse_yaml(text, 0);
    if (root.kind == Node::Kind::kMap) {
      return root;
    }
    const bool empty = root.kind == Node::Kind::kNull;
    reading.add(empty ? Place{} : root.place,
                fmt::format("{}, {} must be a map of keys", empty ? "empty" : "not a map", what));
  } catch (SyntaxError& error) {
    explain(text, error);
    reading.add(error.place, error.what);
  }
  throw InputError(reading.message());
}

}  // namespace touchfield::schema
