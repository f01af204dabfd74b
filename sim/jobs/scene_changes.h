#pragma once

#include <string>
#include <vector>

#include "sim/run/run_compare.h"

namespace touchfield {

/// Where two resolved scenes differ, by key path: `array.at_mm[2]`, 0, 5. A value that only one of them has is a change
/// too.
///
/// throws   InputError if a text is not YAML
std::vector<SceneKeyChange> scene_changes(const std::string& a, const std::string& b);

}  // namespace touchfield
