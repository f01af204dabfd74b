#pragma once

#include <optional>
#include <string>
#include <vector>

#include "sim/pictures/picture_format.h"
#include "sim/solve/model.h"

namespace touchfield {

/// The format of a run's pictures: what is asked for beside the scene, or PNG if the scene's `write` has png; nothing if
/// none are drawn.
std::optional<PictureFormat> picture_format(const Model& model, std::optional<PictureFormat> asked);

/// The names of all files that a run of a scene may write into its directory, pictures in the format asked for beside
/// the scene.
std::vector<std::string> run_files(const Model& model, std::optional<PictureFormat> asked = std::nullopt);

/// The same of a study.
std::vector<std::string> study_files(PictureFormat format);

}  // namespace touchfield
