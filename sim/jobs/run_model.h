#pragma once

#include <optional>

#include "sim/pictures/picture_format.h"
#include "sim/run/job.h"
#include "sim/run/solve_model.h"

namespace touchfield {

/// The format of a run's pictures: what is asked for beside the scene, or PNG if the scene's `write` has png; nothing
/// if none are drawn.
std::optional<PictureFormat> picture_format(const Scene& scene, std::optional<PictureFormat> asked);

/// Computes a scene (solve_model) and writes its results: what the scene's `write` names, and pictures. run.h5 and
/// metrics.csv are written again after each method, so that a later failure loses nothing that was found. The run gets
/// the time that it took to write.
///
/// model      outlives the job
/// pictures   their format, and that there are some whatever the scene says; without it PNG if the scene asks for them
/// throws     (the job) as solve_model; IoError on a failed write
Job<Run> run_job(const Model& model, const SolveOptions& options, std::optional<PictureFormat> pictures = std::nullopt);

/// Writes the results of a finished run of a scene, likewise.
Job<Run> written_job(Run run, const Scene& scene);

}  // namespace touchfield
