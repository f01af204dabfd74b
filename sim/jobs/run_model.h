#pragma once

#include <optional>
#include <string>
#include <vector>

#include "sim/core/progress.h"
#include "sim/pictures/picture_format.h"
#include "sim/run/run_directory.h"
#include "sim/run/solve_model.h"

namespace touchfield {

/// The format of a run's pictures: what is asked for beside the scene, or PNG if the scene's `write` has png; nothing
/// if none are drawn.
std::optional<PictureFormat> picture_format(const Scene& scene, std::optional<PictureFormat> asked);

/// The names of all files that a run of a scene may write into its directory, pictures in the format asked for beside
/// the scene.
std::vector<std::string> run_files(const Scene& scene, std::optional<PictureFormat> asked = std::nullopt);

/// The same of a study.
std::vector<std::string> study_files(PictureFormat format);

/// Writes a finished run: what its scene's `write` names, and pictures in the format given. The run gets the time it
/// took.
/// throws   IoError on a failed write
void write_results(Run& run, const WriteSpec& write, const RunDirectory& directory, Progress& progress,
                   std::optional<PictureFormat> pictures);

/// Computes a scene (solve_model) and writes its results. run.h5 and metrics.csv are written again after each method,
/// so that a later failure loses nothing that was found.
///
/// directory   where the files land
/// pictures    their format, and that there are some whatever the scene says; without it PNG if the scene asks for them
/// returns     the finished run
/// throws      as solve_model; IoError on a failed write
Run run_model(const Model& model, const SolveOptions& options, RunDirectory& directory, Progress& progress,
              std::optional<PictureFormat> pictures = std::nullopt);

}  // namespace touchfield
