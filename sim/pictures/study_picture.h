#pragma once

#include <optional>
#include <string>
#include <vector>

#include "sim/pictures/picture_format.h"
#include "sim/store/study_files.h"

namespace touchfield {

/// A picture of 1200 x 900 pixels: error_reference [%] against seconds, both logarithmic, a marker a scheme, the rungs
/// marked `pareto` outlined and joined by a line, the picked one in a ring. Rungs whose seconds or error are not > 0
/// are left out and counted below.
///
/// path     where it lands, whole or not at all
/// title    in bold above
/// picked   number of a rung
/// throws   IoError if it cannot be written
void draw_study(const std::string& path, const std::string& title, const std::vector<StudyRung>& rungs,
                std::optional<std::size_t> picked, PictureFormat format);

}  // namespace touchfield
