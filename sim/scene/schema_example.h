#pragma once

#include <string>

#include "sim/scene/schema_info.h"
#include "sim/scene/yaml_tree.h"

/// Values that a scene may have, derived from the tables of its maps.
namespace touchfield::schema {

/// A value of a key: the example of its row, otherwise its default, otherwise derived from its type. A derived map has
/// the keys that it must have, and at least one. A default that is empty is not an example.
Node example_of(const KeyInfo& key);

/// A map with this value of a key, and with examples of the other keys that it then must have.
Node example_with(const MapInfo& info, const std::string& name, const Node& value);

}  // namespace touchfield::schema
