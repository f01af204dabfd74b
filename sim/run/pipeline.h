#pragma once

#include "sim/core/progress.h"
#include "sim/output/run_data.h"
#include "sim/run/kept_models.h"
#include "sim/run/model.h"
#include "sim/run/run_directory.h"

namespace touchfield {

struct RunOptions {
  std::string command_line;      // kept as provenance
  int threads = 1;               // likewise; the caller has set them
  KeptBodies* bodies = nullptr;  // meshes and models of scenes before this one
  KeptModels* models = nullptr;
};

/// Computes a scene and writes its results: B p = G q assembled and factorised, every method solved and judged by the
/// scattered pressure p = B^-1 G q, the fields, then the files. run.h5 and metrics.csv are written anew after each
/// method, so that a later failure loses nothing that was found.
///
/// model       of this scene
/// directory   where the files land
/// returns     the finished run
/// throws      NumericalError if a matrix is singular or a pressure not finite, IoError on a failed write; a solve that
///             misses its tolerance is a warning of the run
Run run_scene(const Scene& scene, const Model& model, const RunOptions& options, RunDirectory& directory,
              Progress& progress);

}  // namespace touchfield
