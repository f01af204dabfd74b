#pragma once

#include <optional>
#include <string>
#include <vector>

#include "sim/scene/input.h"

namespace touchfield::schema {

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
