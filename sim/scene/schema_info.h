#pragma once

#include <cstddef>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "sim/scene/quantity.h"
#include "sim/scene/yaml_tree.h"

namespace touchfield::schema {

struct MapInfo;

/// What a value may be: plain data, from which checks, messages and pages are made.
struct TypeInfo {
  enum class Kind {
    kNumber,
    kInteger,
    kFlag,   // true or false
    kWord,   // one of `words`
    kName,   // letters, digits, _ and -
    kText,   // any text
    kFile,   // the name of a file
    kList,   // of values of type of[0]
    kMap,    // of the keys in `map`
    kTable,  // of free names to values of type of[0]
    kAny,    // one of the types in `of`
  };
  static constexpr std::size_t kNoLimit = std::numeric_limits<std::size_t>::max();

  Kind kind = Kind::kText;
  Range range{};                     // of a number
  std::vector<std::string> words{};  // of a word
  std::size_t fewest = 0;            // items of a list, bytes of a text
  std::size_t most = kNoLimit;       // items of a list
  bool distinct = false;             // items of a list are all different
  std::vector<TypeInfo> of{};
  std::shared_ptr<const MapInfo> map{};
};

/// What a key of a map means.
struct KeyInfo {
  std::string name{};
  TypeInfo type{};
  std::string help{};
  bool required = false;                 // with `only_with`: required beside those
  std::string example{};                 // for editors, YAML in one line; empty: the default
  std::string fallback{};                // the default as YAML in one line; empty if there is none
  std::vector<std::string> only_with{};  // allowed only beside one of these keys of the map's group
  std::vector<std::string> also_with{};  // and these, beside which it is not required
  std::vector<std::pair<std::string, std::size_t>> items_with{};  // length of the list beside a key of the group

  /// Whether it may be given beside this key of the group.
  bool fits(const std::string& chosen) const;
};

/// Keys of a map that exclude each other.
struct Group {
  std::vector<std::string> keys{};
  bool required = true;  // exactly one, not at most one
};

struct MapInfo {
  std::vector<KeyInfo> keys{};
  std::optional<Group> group{};

  std::vector<std::string> names() const;  // of the keys
};

inline constexpr std::size_t kLongestName = 100;    // a name becomes a folder
inline constexpr std::size_t kMostListed = 10'000;  // transducers or phases one by one; arrays have hundreds
inline constexpr std::size_t kMostItems = 100;      // methods, target boxes, fields: a page of them

/// True for 1 to kLongestName letters, digits, _ and -.
bool is_name(const std::string& text);

bool contains(const std::vector<std::string>& list, const std::string& item);

/// What a value of this type is, as it follows "must be": "a list of 3 numbers > 0".
std::string phrase(const TypeInfo& type, bool with_range = true);

// Values that a scene may have, derived from the tables of its maps.

/// A value of a key: the example of its row, otherwise its default, otherwise derived from its type. A derived map has
/// the keys that it must have, and at least one. A default that is empty is not an example.
Node example_of(const KeyInfo& key);

/// A map with this value of a key, and with examples of the other keys that it then must have.
Node example_with(const MapInfo& info, const std::string& name, const Node& value);

/// Smallest number of insertions, deletions, replacements and swaps of neighbours that turn a into b
/// (optimal string alignment: no letter is edited twice).
std::size_t edit_distance(std::string_view a, std::string_view b);

/// A key without the unit it ends in: radius_cm -> radius, source_pa_m -> source.
std::string_view without_unit(std::string_view key);

/// The one of `words` that differs from `text` in the fewest letters; empty if none is near.
std::string nearest_word(const std::vector<std::string>& words, std::string_view text);

/// The known key that an unknown one was probably meant to be, as it is written from this map. It is a key of the map
/// with another unit, a few other letters, or another name of a position ("centre_mm" for "at_mm"). Or it is a key of a
/// map one level below ("box.size_mm"). Empty if none is near.
std::string nearest_key(const MapInfo& map, std::string_view unknown);

}  // namespace touchfield::schema
