#pragma once

#include <string>

#include "sim/store/run_compare.h"

namespace touchfield {

/// Where two resolved scenes differ, by key path: `array.at_mm[2]`, 0, 5. A key, or an element of a list, that only one
/// of them has is one change, with its value in one line of YAML. Numbers are compared as numbers: 5 is 5.0. There are
/// no changes if the scenes say the same.
///
/// Lists of the same length are compared element by element. If the lengths differ, equal elements at the front and at
/// the back are left out first. Elements are numbered as in the scene that has them.
///
/// A key of the scene's table that one of the scenes lacks stands for the meaning of a scene without it. This is
/// `KeyInfo::before` if there is one, the meaning of scenes from before the key existed. Otherwise it is the default.
/// If the other scene says the same, this is not a change and the key is listed separately. Otherwise this meaning is
/// shown in place of the absent value.
///
/// throws   InputError if a text is not YAML
SceneDifference scene_changes(const std::string& a, const std::string& b);

}  // namespace touchfield
