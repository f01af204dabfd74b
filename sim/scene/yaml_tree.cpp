#include "sim/scene/yaml_tree.h"

#include <algorithm>
#include <map>
#include <sstream>

#include <fmt/format.h>
#include <yaml-cpp/emitter.h>
#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/exceptions.h>
#include <yaml-cpp/mark.h>
#include <yaml-cpp/parser.h>

namespace touchfield::schema {

namespace {

// A scene of 10,000 transducers with axes and phases has 90,000 values, its maps at most 20 keys but for landmarks, and
// it nests 8 deep.
constexpr std::size_t kMostValues = 200'000;
constexpr std::size_t kMostCopiedBytes = std::size_t{16} << 20U;
constexpr std::size_t kMostKeys = 1000;
constexpr std::size_t kDeepest = 50;

struct Size {
  std::size_t values = 0;
  std::size_t bytes = 0;  // of their texts and keys
};

void add_size(const Node& node, Size& size) {
  ++size.values;
  size.bytes += node.text.size();
  for (const auto& item : node.items) {
    add_size(item, size);
  }
  for (const auto& entry : node.entries) {
    size.bytes += entry.key.size();
    add_size(entry.value, size);
  }
}

// Builds the tree from the parser's events: the library's own node type drops the places of keys and shares values.
class TreeBuilder : public YAML::EventHandler {
 public:
  explicit TreeBuilder(int source) : source_(source) {}

  bool found() const { return found_; }
  Node take() { return std::move(root_); }

  void OnDocumentStart(const YAML::Mark& mark) override {
    if (found_) {
      throw SyntaxError{place(mark), "a second document, a scene is one document"};
    }
    found_ = true;
  }
  void OnDocumentEnd() override {}

  void OnNull(const YAML::Mark& mark, YAML::anchor_t anchor) override {
    Node node;
    node.place = place(mark);
    finish(std::move(node), anchor);
  }

  void OnScalar(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                const std::string& value) override {
    refuse_tag(mark, tag);
    Node node = scalar(value);
    node.place = place(mark);
    node.quoted = tag == "!";
    finish(std::move(node), anchor);
  }

  void OnAlias(const YAML::Mark& mark, YAML::anchor_t anchor) override {
    const auto found = anchors_.find(anchor);
    if (found == anchors_.end()) {
      throw SyntaxError{place(mark), "an alias inside its own anchor"};
    }
    count_copy(found->second, place(mark));
    finish(found->second, 0);
  }

  void OnSequenceStart(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                       YAML::EmitterStyle::value /*style*/) override {
    open(Node::Kind::kList, mark, tag, anchor);
  }
  void OnMapStart(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                  YAML::EmitterStyle::value /*style*/) override {
    open(Node::Kind::kMap, mark, tag, anchor);
  }
  void OnSequenceEnd() override { close(); }
  void OnMapEnd() override { close(); }

 private:
  struct Level {
    Node node;
    YAML::anchor_t anchor;
    bool key_read = false;  // of a map: the next value belongs to the last entry
  };

  Place place(const YAML::Mark& mark) const { return {source_, mark.line + 1, mark.column + 1}; }

  void refuse_tag(const YAML::Mark& mark, const std::string& tag) const {
    const bool plain = tag.empty() || tag == "?" || tag == "!";
    if (!plain) {
      throw SyntaxError{place(mark), "a tag (" + tag + "), a scene has none"};
    }
  }

  void open(Node::Kind kind, const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor) {
    refuse_tag(mark, tag);
    if (levels_.size() >= kDeepest) {
      throw SyntaxError{place(mark), fmt::format("nested deeper than {} levels", kDeepest)};
    }
    Level level{.node = {}, .anchor = anchor};
    level.node.kind = kind;
    level.node.place = place(mark);
    levels_.push_back(std::move(level));
  }

  void close() {
    Level level = std::move(levels_.back());
    levels_.pop_back();
    merge(level.node);
    finish(std::move(level.node), level.anchor);
  }

  /// Takes the keys that a map does not have from the maps of its merge keys.
  void merge(Node& node) {
    std::vector<Entry> own;
    std::vector<Entry> merged;
    for (Entry& entry : node.entries) {
      (entry.merges ? merged : own).push_back(std::move(entry));
    }
    node.entries = std::move(own);
    for (Entry& entry : merged) {
      std::vector<Node> maps;
      if (entry.value.kind == Node::Kind::kList) {
        maps = std::move(entry.value.items);
      } else {
        maps.push_back(std::move(entry.value));
      }
      for (Node& map : maps) {
        if (map.kind != Node::Kind::kMap) {
          throw SyntaxError{entry.place, "a merge key (<<) must have a map or a list of maps, as in <<: *name"};
        }
        for (Entry& other : map.entries) {
          if (node.find(other.key) == nullptr) {
            require_few_keys(node, other.place);
            node.entries.push_back(std::move(other));
          }
        }
      }
    }
  }

  void require_few_keys(const Node& node, const Place& at) const {
    if (node.entries.size() == kMostKeys) {
      throw SyntaxError{at, fmt::format("more than {} keys in one map", kMostKeys)};
    }
  }

  void count_copy(const Node& node, const Place& at) {
    Size size;
    add_size(node, size);
    count(size.values, at);
    copied_bytes_ += size.bytes;
    if (copied_bytes_ > kMostCopiedBytes) {
      throw SyntaxError{at, fmt::format("more than {} MiB of text up to here that anchors and aliases copy",
                                        kMostCopiedBytes >> 20U)};
    }
  }

  /// More values, of the text or of copies.
  void count(std::size_t values, const Place& at) {
    values_ += values;
    if (values_ > kMostValues) {
      throw SyntaxError{at, fmt::format("more than {} values up to here, copies by aliases counted", kMostValues)};
    }
  }

  void finish(Node node, YAML::anchor_t anchor) {
    count(1, node.place);
    if (anchor != 0) {
      count_copy(node, node.place);
      anchors_[anchor] = node;
    }
    if (levels_.empty()) {
      root_ = std::move(node);
      return;
    }
    Level& parent = levels_.back();
    if (parent.node.kind == Node::Kind::kList) {
      parent.node.items.push_back(std::move(node));
    } else if (parent.key_read) {
      Entry& entry = parent.node.entries.back();
      // The parser places a value that is left out at whatever comes next.
      if (node.kind == Node::Kind::kNull) {
        node.place = entry.place;
      }
      entry.value = std::move(node);
      parent.key_read = false;
    } else {
      if (node.kind != Node::Kind::kScalar) {
        throw SyntaxError{node.place, "a key that is not a word"};
      }
      require_few_keys(parent.node, node.place);
      const bool merges = node.text == "<<" && !node.quoted;
      parent.node.entries.push_back({std::move(node.text), node.place, {}, merges});
      parent.key_read = true;
    }
  }

  int source_;
  bool found_ = false;
  Node root_;
  std::vector<Level> levels_;
  std::map<YAML::anchor_t, Node> anchors_;
  std::size_t values_ = 0;
  std::size_t copied_bytes_ = 0;
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
    while (parser.HandleNextDocument(builder)) {
    }
  } catch (const YAML::Exception& error) {
    const auto& mark = error.mark;
    throw SyntaxError{mark.is_null() ? Place{source} : Place{source, mark.line + 1, mark.column + 1},
                      "not YAML: " + error.msg};
  }
  if (builder.found()) {
    return builder.take();
  }
  Node nothing;
  nothing.place.source = source;
  return nothing;
}

std::string block_text(const Node& node) { return emitted(node, false) + "\n"; }
std::string flow_text(const Node& node) { return emitted(node, true); }

}  // namespace touchfield::schema
