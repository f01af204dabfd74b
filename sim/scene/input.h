#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "sim/core/errors.h"
#include "sim/scene/yaml_tree.h"

namespace touchfield::schema {

/// One reading of a scene: how its sources are called in messages, and the problems found so far.
class Reading {
 public:
  /// file        the scene file as the user named it
  /// overrides   the --set texts; source n of a Place is the n-th, from 1
  Reading(std::string file, std::vector<std::string> overrides);
  /// folder    what relative paths count from, in the text and in the overrides
  /// changes   what messages call an override
  Reading(std::string name, std::vector<std::string> overrides, std::string folder, std::string changes);

  /// What messages call the file.
  const std::string& file() const { return file_; }
  /// A text behind its place: "scene.yaml:4:11: TEXT", "--set body.x=1: TEXT". Of a scene without a name, which a
  /// program wrote, the text alone.
  std::string placed(const Place& place, const std::string& text) const;

  /// A problem at a place, its text without the place.
  void add(const Place& place, const std::string& text);

  bool failed() const { return !problems_.empty(); }
  /// Every problem, one per line, those of the file in its order, then those of the overrides.
  std::string message() const;

  /// The path of a file named at a place: a relative name in the scene counts from the scene's folder, one in an
  /// override from the working directory.
  std::string resolve(const Place& place, const std::string& name) const;

 private:
  struct Problem {
    Place place;
    std::string text;
  };

  std::string file_;
  std::vector<std::string> overrides_;
  std::string folder_;           // of the scene
  std::string override_folder_;  // of the overrides
  std::string changes_ = "--set";
  std::vector<Problem> problems_;
};

/// A value on its way into the scene: what was written, how it is called, and where to complain.
class Input {
 public:
  /// node, reading   outlive this
  Input(const Node& node, std::string path, Reading& reading);
  Input(const Node&&, std::string, Reading&) = delete;

  const Node& node() const { return *node_; }
  const std::string& path() const { return path_; }
  Reading& reading() const { return *reading_; }

  Input at(const Entry& entry) const { return {entry.value, path_of(entry.key), *reading_}; }
  Input at(const Entry&&) const = delete;
  Input at(std::size_t item) const;
  /// The value of a key that this map has.
  Input key(std::string_view name) const { return at(*node_->find(name)); }
  /// How a key of this map is called.
  std::string path_of(const std::string& key) const;

  /// The problem "path = value must be rule", e.g. `field[0].spacing_mm = -1 must be > 0`. Returns false.
  bool must_be(const std::string& rule) const;
  /// The problem "path: text" at this value. Returns false.
  bool problem(const std::string& text) const;

 private:
  const Node* node_;
  std::string path_;
  Reading* reading_;
};

/// What `read` makes of a file that the scene names. An InputError becomes a problem of the scene, and nothing.
template <class Read>
auto read_named(const Input& in, const Read& read) -> std::optional<decltype(read())> {
  try {
    return read();
  } catch (const InputError& error) {
    in.problem(error.what());
    return std::nullopt;
  }
}

/// The values of a text file that must hold one map: a scene, a sweep.
///
/// what     how messages call the file, e.g. "a scene"
/// throws   InputError with what `reading` has found: text that is not UTF-8, not YAML or not a map
Node read_map(const std::string& text, std::string_view what, Reading& reading);

/// A text as a message quotes it: blanks for control characters, cut after `longest` bytes.
std::string quoted_for_message(const std::string& text, std::size_t longest = 60);

/// "a.b[0].c" as a, b, 0, c; nothing if a part is empty or a bracket stands alone.
std::optional<std::vector<std::string>> split_path(const std::string& path);

/// Puts the value of "key.path=value" in its place in a scene, before the scene is read.
///
/// The path names keys and, in lists, numbers from 0: solve.methods.0 or solve.methods[0]. Maps on the way that are not
/// there are made. The value is YAML; null takes a key away. A path that leads nowhere is reported.
///
/// source   the number of the override in the reading, from 1
void apply_override(Node& root, const std::string& text, int source, Reading& reading);

}  // namespace touchfield::schema
