#pragma once

#include <string>
#include <vector>

#include "sim/pictures/picture_format.h"
#include "sim/run/run_data.h"

namespace touchfield {

/// Draws the pictures of a run:
///
/// setup.png               the skin and an array of transducers
/// target.png              the wanted |p|
/// pressure_NAME.png       |p| of a method, one picture per method
/// overview.png            all of these pictures of the skin side by side
/// field_NAME_METHOD.png   one picture per plane among the fields and per method
///
/// Target, pressures and overview show the skin seen from the array's side. They share one colour scale, with a colour
/// bar and a caption. The ending is the format's. The texts in each file say which run it shows: Software, Source,
/// Description, Scene hash (see Canvas::describe). A file appears whole or not at all.
///
/// directory   where they land
/// returns     the files written
/// throws      IoError if a picture cannot be written
std::vector<std::string> draw_figures(const std::string& directory, const Run& run, PictureFormat format);

/// One of them by its name without the ending, e.g. "pressure_surface": the bytes of its file.
/// throws      InputError that lists the names there are
std::string draw_figure(const std::string& name, const Run& run, PictureFormat format);

}  // namespace touchfield
