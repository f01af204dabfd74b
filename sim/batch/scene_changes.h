#pragma once

#include <string>

#include "sim/store/run_compare.h"

namespace touchfield {

/// Where two resolved scenes differ, by key path: `array.at_mm[2]`, 0, 5. A key, or an element of a list, that only one
/// of them has is one change, its value in one line of YAML. Lists of one length are compared element by element; of
/// other lengths, what they share at the front and at the back is left out first, and elements are numbered as in the
/// scene that has them. Numbers are compared as numbers: 5 is 5.0. No changes if the scenes say the same.
///
/// A key of the scene's table that one of them lacks stands for what a scene means without it: the default or, where
/// that has become another since there is the key, what was done before (`KeyInfo::before`). If that is what the other
/// scene says, it is no change and listed apart; else it is shown in place of the value that is absent.
///
/// throws   InputError if a text is no YAML
SceneDifference scene_changes(const std::string& a, const std::string& b);

}  // namespace touchfield
