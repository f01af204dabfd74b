#pragma once

#include "sim/motion/pattern.h"
#include "sim/run/job.h"

namespace touchfield {

/// Solves a scene's pattern (solve_pattern) and writes its results:
///
///   pattern.h5     in the layout of motion.h5
///   pattern.csv    one row per frame
///   spectrum.csv   one row per point and line
///   strip.png      a strip of pictures
///
/// model    outlives the job
/// throws   (the job) as solve_pattern; IoError on a failed write
Job<Pattern> pattern_job(const Model& model, const PatternOptions& options);

}  // namespace touchfield
