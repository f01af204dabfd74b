#pragma once

#include <optional>
#include <string>
#include <vector>

#include "sim/core/json.h"
#include "sim/core/progress.h"
#include "sim/motion/pattern.h"
#include "sim/pictures/picture_format.h"
#include "sim/run/run_directory.h"

namespace touchfield {

/// The names of all files that a pattern may write into its directory.
std::vector<std::string> pattern_files(const Scene& scene, std::optional<PictureFormat> asked = std::nullopt);

/// Solves a scene's pattern (solve_pattern) and writes its results:
///
///   pattern.h5     in the layout of motion.h5
///   pattern.csv    one row per frame
///   spectrum.csv   one row per point and line
///   strip.FORMAT   a strip of pictures
///
/// pictures   as play_scene's
/// throws     as solve_pattern; IoError on a failed write
Pattern run_pattern(const Model& model, const PatternOptions& options, RunDirectory& directory, Progress& progress,
                    std::optional<PictureFormat> pictures = std::nullopt);

/// What a command says of a pattern.
Json pattern_value(const Pattern& pattern);

}  // namespace touchfield
