#pragma once

#include <string>
#include <vector>

#include "sim/store/difference.h"

namespace touchfield {

/// Where two resolved scenes differ, by key path: `array.at_mm[2]`, 0, 5. A key, or an element of a list, that only one
/// of them has is one change, its value in one line of YAML. Lists of one length are compared element by element; of
/// other lengths, what they share at the front and at the back is left out first, and elements are numbered as in the
/// scene that has them. Numbers are compared as numbers: 5 is 5.0. Empty if the scenes say the same.
///
/// throws   InputError if a text is no YAML
std::vector<TextChange> scene_changes(const std::string& a, const std::string& b);

}  // namespace touchfield
