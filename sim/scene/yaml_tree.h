#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

namespace touchfield::schema {

/// The most that a text for a person to write may have: 10,000 positions with axes, all digits written out, take three
/// quarters of it. The YAML parser takes up to half a second and a quarter of a gigabyte a mebibyte.
inline constexpr std::size_t kMostTextBytes = std::size_t{2} << 20U;

/// A text without the blanks at its ends.
std::string_view trimmed(std::string_view text);

/// Parts between commas and blanks, any number of them.
std::vector<std::string_view> words(std::string_view line, std::string_view between = ", \t");

/// Parts between single commas, or another separator; between blanks it is any number of them.
std::vector<std::string_view> cells(std::string_view line, char separator = ',');

/// Where a value was written: line and column, from 1, of the scene file (source 0) or of override number `source`.
struct Place {
  int source = 0;
  int line = 1;
  int column = 1;

  /// The order in which problems are reported.
  friend bool operator<(const Place& a, const Place& b) {
    return std::tie(a.source, a.line, a.column) < std::tie(b.source, b.line, b.column);
  }
};

struct Entry;

/// A YAML value with its place. A plain value type: copies share nothing, duplicate keys are kept.
struct Node {
  enum class Kind { kNull, kScalar, kList, kMap };

  Kind kind = Kind::kNull;
  Place place;
  std::string text;            // of a scalar
  bool quoted = false;         // a scalar in quotes is text whatever it looks like
  std::vector<Node> items;     // of a list
  std::vector<Entry> entries;  // of a map, in file order
  bool removed = false;        // an override took this value away

  /// The first entry of this key that was not taken away; null if there is none.
  const Entry* find(std::string_view key) const;
  Entry* find_even_removed(std::string_view key);
};

struct Entry {
  std::string key;
  Place place;  // of the key
  Node value;
};

/// "; a blank must follow the colon of pressure_pa" of a text that ends with such a word, colon and value, or has them
/// before; else empty.
std::string missing_blank(std::string_view text);

Node scalar(std::string text);
Node list(std::vector<Node> items);
Node map(std::vector<std::pair<std::string, Node>> entries);

/// Why a text is not one YAML document of plain values.
struct SyntaxError {
  Place place;
  std::string what;
};

/// The one document in a text. An empty text is a null. Anchors, aliases and merge keys are resolved. `<<: *name`, or a
/// list of maps, adds the keys of those maps that the map does not have. Of maps with the same key the first counts.
///
/// throws   SyntaxError with the library's words on text that is not YAML; on a second document, a key that is not a
///          word, a tag, more than 200,000 values (copies by aliases count each time, a long text counts as several),
///          more than 1000 keys in a map or 50 levels
Node parse_yaml(const std::string& text, int source);

/// The value as YAML text: maps and lists of them in block style, lists of scalars in one line.
std::string block_text(const Node& node);
/// The value in one line, without an end of line.
std::string flow_text(const Node& node);

}  // namespace touchfield::schema
