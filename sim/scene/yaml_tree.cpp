#include "sim/scene/yaml_tree.h"

#include <algorithm>
#include <sstream>

#include <fmt/format.h>
#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/yaml.h>

namespace touchfield::schema {

namespace {

constexpr std::string_view kBlanks = " \t";  // between words

// A scene of 10,000 transducers with axes and phases has 90,000 values, its maps at most 20 keys but for landmarks, and
// it nests 8 deep.
constexpr std::size_t kMostValues = 200'000;
constexpr std::size_t kLettersOfValue = 100;  // of a text that count as one value more
constexpr std::size_t kMostKeys = 1000;
constexpr std::size_t kDeepest = 50;

/// Copies the library's nodes, which share the values of aliases.
class TreeBuilder {
 public:
  explicit TreeBuilder(int source) : source_(source) {}

  Place place(const YAML::Mark& mark) const {
    return mark.is_null() ? Place{source_} : Place{source_, mark.line + 1, mark.column + 1};
  }

  Node tree(const YAML::Node& from, std::size_t depth = 0) {
    Node node;
    node.place = place(from.Mark());
    const std::string& tag = from.Tag();
    if (!tag.empty() && tag != "?" && tag != "!") {
      throw SyntaxError{node.place, "a tag (" + tag + "), a scene has none"};
    }
    if (depth > kDeepest) {
      throw SyntaxError{node.place, fmt::format("nested deeper than {} levels", kDeepest)};
    }
    values_ += 1 + (from.IsScalar() ? from.Scalar().size() / kLettersOfValue : 0);
    if (values_ > kMostValues) {
      throw SyntaxError{node.place,
                        fmt::format("more than {} values up to here, copies by aliases counted", kMostValues)};
    }
    if (from.IsScalar()) {
      node.kind = Node::Kind::kScalar;
      node.text = from.Scalar();
      node.quoted = tag == "!";
    } else if (from.IsSequence()) {
      node.kind = Node::Kind::kList;
      for (const YAML::Node& item : from) {
        node.items.push_back(tree(item, depth + 1));
      }
    } else if (from.IsMap()) {
      node.kind = Node::Kind::kMap;
      fill_map(from, depth, node);
    }
    return node;
  }

 private:
  void fill_map(const YAML::Node& from, std::size_t depth, Node& node) {
    std::vector<Entry> merged;
    for (const auto& pair : from) {
      Node key = tree(pair.first, depth + 1);
      if (key.kind != Node::Kind::kScalar) {
        throw SyntaxError{key.place, "a key that is not a word"};
      }
      Node value = tree(pair.second, depth + 1);
      if (value.kind == Node::Kind::kNull) {  // the parser places one that is left out at whatever comes next
        value.place = key.place;
      }
      const bool merges = key.text == "<<" && !key.quoted;
      add(merges ? merged : node.entries, {std::move(key.text), key.place, std::move(value)});
    }
    for (Entry& entry : merged) {
      std::vector<Node> maps = std::move(entry.value.items);
      if (entry.value.kind != Node::Kind::kList) {
        maps.push_back(std::move(entry.value));
      }
      for (Node& map : maps) {
        if (map.kind != Node::Kind::kMap) {
          throw SyntaxError{entry.place, "a merge key (<<) must have a map or a list of maps, as in <<: *name"};
        }
        for (Entry& other : map.entries) {
          if (node.find(other.key) == nullptr) {
            add(node.entries, std::move(other));
          }
        }
      }
    }
  }

  static void add(std::vector<Entry>& entries, Entry entry) {
    if (entries.size() == kMostKeys) {
      throw SyntaxError{entry.place, fmt::format("more than {} keys in one map", kMostKeys)};
    }
    entries.push_back(std::move(entry));
  }

  int source_;
  std::size_t values_ = 0;
};

/// Finds a second document before the library makes nodes of the first alone.
class OneDocument : public YAML::EventHandler {
 public:
  explicit OneDocument(int source) : source_(source) {}

  void OnDocumentStart(const YAML::Mark& mark) override {
    if (found_) {
      throw SyntaxError{{source_, mark.line + 1, mark.column + 1}, "a second document, a scene is one document"};
    }
    found_ = true;
  }
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark&, YAML::anchor_t) override {}
  void OnAlias(const YAML::Mark&, YAML::anchor_t) override {}
  void OnScalar(const YAML::Mark&, const std::string&, YAML::anchor_t, const std::string&) override {}
  void OnSequenceStart(const YAML::Mark&, const std::string&, YAML::anchor_t, YAML::EmitterStyle::value) override {}
  void OnSequenceEnd() override {}
  void OnMapStart(const YAML::Mark&, const std::string&, YAML::anchor_t, YAML::EmitterStyle::value) override {}
  void OnMapEnd() override {}

 private:
  int source_;
  bool found_ = false;
};

bool holds_only_scalars(const Node& node) {
  return std::none_of(node.items.begin(), node.items.end(),
                      [](const Node& item) { return item.kind == Node::Kind::kList || item.kind == Node::Kind::kMap; });
}

void emit(YAML::Emitter& out, const Node& node, bool flow) {
  switch (node.kind) {
    case Node::Kind::kNull:
      out << YAML::Null;
      break;
    case Node::Kind::kScalar:
      if (node.quoted) {
        out << YAML::DoubleQuoted;
      }
      out << node.text;
      break;
    case Node::Kind::kList:
      out << (flow || holds_only_scalars(node) ? YAML::Flow : YAML::Block) << YAML::BeginSeq;
      for (const auto& item : node.items) {
        emit(out, item, flow);
      }
      out << YAML::EndSeq;
      break;
    case Node::Kind::kMap:
      out << (flow || node.entries.empty() ? YAML::Flow : YAML::Block) << YAML::BeginMap;
      for (const auto& entry : node.entries) {
        out << YAML::Key << entry.key << YAML::Value;
        emit(out, entry.value, flow);
      }
      out << YAML::EndMap;
      break;
  }
}

std::string emitted(const Node& node, bool flow) {
  YAML::Emitter out;
  emit(out, node, flow);
  return out.c_str();
}

}  // namespace

std::string_view trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(" \t");
  if (first == std::string_view::npos) {
    return {};
  }
  return text.substr(first, text.find_last_not_of(" \t") - first + 1);
}

std::string missing_blank(std::string_view text) {
  constexpr std::string_view kWord = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_";
  constexpr std::string_view kNoValue = " \t\r\n,]}/\\";  // behind the colon of a path, or of a map that goes on
  for (std::size_t colon = text.rfind(':'); colon != std::string_view::npos && colon > 0;
       colon = text.rfind(':', colon - 1)) {
    const std::size_t before = text.find_last_not_of(kWord, colon - 1);
    const std::size_t begin = before == std::string_view::npos ? 0 : before + 1;
    const std::size_t line = text.rfind('\n', colon) + 1;
    const bool is_key =
        begin < colon && (begin == line || std::string_view(" {,").find(text[begin - 1]) != std::string_view::npos);
    const bool is_comment = text.substr(line, colon - line).find('#') != std::string_view::npos;
    if (is_key && !is_comment && colon + 1 < text.size() && kNoValue.find(text[colon + 1]) == std::string_view::npos) {
      return fmt::format("; a blank must follow the colon of {}", text.substr(begin, colon - begin));
    }
  }
  return "";
}

std::vector<std::string_view> words(std::string_view line, std::string_view between) {
  std::vector<std::string_view> parts;
  for (auto first = line.find_first_not_of(between); first != std::string_view::npos;) {
    const auto end = std::min(line.find_first_of(between, first), line.size());
    parts.push_back(line.substr(first, end - first));
    first = line.find_first_not_of(between, end);
  }
  return parts;
}

std::vector<std::string_view> cells(std::string_view line, char separator) {
  if (separator == ' ') {
    return words(line, kBlanks);
  }
  std::vector<std::string_view> parts;
  for (std::size_t at = 0; at <= line.size(); at += parts.back().size() + 1) {
    parts.push_back(line.substr(at, line.substr(at).find(separator)));
  }
  std::ranges::transform(parts, parts.begin(), trimmed);
  return parts;
}

const Entry* Node::find(std::string_view key) const {
  const auto entry =
      std::find_if(entries.begin(), entries.end(), [&](const Entry& e) { return e.key == key && !e.value.removed; });
  return entry == entries.end() ? nullptr : &*entry;
}

Entry* Node::find_even_removed(std::string_view key) {
  const auto entry = std::find_if(entries.begin(), entries.end(), [&](const Entry& e) { return e.key == key; });
  return entry == entries.end() ? nullptr : &*entry;
}

Node scalar(std::string text) {
  Node node;
  node.kind = Node::Kind::kScalar;
  node.text = std::move(text);
  return node;
}

Node list(std::vector<Node> items) {
  Node node;
  node.kind = Node::Kind::kList;
  node.items = std::move(items);
  return node;
}

Node map(std::vector<std::pair<std::string, Node>> entries) {
  Node node;
  node.kind = Node::Kind::kMap;
  for (auto& entry : entries) {
    node.entries.push_back({std::move(entry.first), {}, std::move(entry.second)});
  }
  return node;
}

Node parse_yaml(const std::string& text, int source) {
  TreeBuilder builder(source);
  try {
    std::istringstream stream(text);
    YAML::Parser parser(stream);
    OneDocument document(source);
    while (parser.HandleNextDocument(document)) {
    }
    return builder.tree(YAML::Load(text));
  } catch (const YAML::Exception& error) {
    const Place place = builder.place(error.mark);
    std::size_t end = 0;  // of the line where the parser stopped
    for (int line = 0; line < place.line && end != std::string::npos; ++line) {
      end = text.find('\n', end + (line > 0 ? 1 : 0));
    }
    throw SyntaxError{place, "not YAML: " + error.msg + missing_blank(std::string_view(text).substr(0, end))};
  }
}

std::string block_text(const Node& node) { return emitted(node, false) + "\n"; }
std::string flow_text(const Node& node) { return emitted(node, true); }

}  // namespace touchfield::schema
