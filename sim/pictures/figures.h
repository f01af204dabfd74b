#pragma once

#include <string>
#include <vector>

#include "sim/pictures/picture_format.h"
#include "sim/store/run_data.h"

namespace touchfield {

/// Pictures of a run: setup.png shows array and skin. Of the skin seen from the array's side: target.png (the wanted
/// |p|) and pressure_NAME.png for every method, and overview.png with all of these side by side; one colour scale for
/// all, with a colour bar and a caption. Also
/// field_NAME_METHOD.png for every plane among the fields. The ending is the format's. Each says in its file's texts
/// which run it shows: Software, Source, Description, Scene hash (see Canvas::describe). Whole or not at all.
///
/// directory   where they land
/// returns     the files written
/// throws      IoError if a picture cannot be written
std::vector<std::string> draw_figures(const std::string& directory, const Run& run, PictureFormat format);

/// One of them by its name without the ending, e.g. "pressure_surface": the bytes of its file.
/// throws      InputError that lists the names there are
std::string draw_figure(const std::string& name, const Run& run, PictureFormat format);

}  // namespace touchfield
