#pragma once

#include "sim/run/job.h"
#include "sim/run/solve_model.h"

namespace touchfield {

/// Computes a scene (solve_model) and writes its results: what the scene's `write` names. run.h5 and metrics.csv are
/// written again after each method, so that a later failure loses nothing that was found. The run gets the time that it
/// took to write.
///
/// model    outlives the job
/// throws   (the job) as solve_model; IoError on a failed write
Job<Run> run_job(const Model& model, const SolveOptions& options);

/// Writes the results of a finished run of a scene, likewise.
Job<Run> written_job(Run run, const Scene& scene);

}  // namespace touchfield
