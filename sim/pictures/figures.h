#pragma once

#include <string>
#include <vector>

#include "sim/store/run_data.h"

namespace touchfield {

/// True if pictures can be drawn here: a display that answers is there.
bool can_draw();

/// Pictures of the skin seen from the array's side, rendered off screen: target.png (the wanted |p|) and
/// pressure_NAME.png for every method, one colour scale for all, with a colour bar and a caption. Also
/// field_NAME_METHOD.png for every plane among the fields. Each says in its PNG texts which run it shows: Software,
/// Source, Description, Scene hash. Whole or not at all.
///
/// directory   where they land
/// returns     the files written
/// throws      IoError if a picture cannot be written; NotBuiltError if can_draw() is false
std::vector<std::string> draw_figures(const std::string& directory, const Run& run);

}  // namespace touchfield
