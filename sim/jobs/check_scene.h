#pragma once

#include <optional>

#include "sim/core/json.h"
#include "sim/core/progress.h"
#include "sim/jobs/sweep.h"
#include "sim/model/warnings.h"
#include "sim/motion/pattern.h"
#include "sim/motion/play.h"
#include "sim/run/check.h"
#include "sim/run/estimates.h"

namespace touchfield {

/// What a scene would build and cost, of all its parts.
struct SceneCheck {
  Model model;
  CheckReport report;
  std::optional<AccuracyReport> accuracy;
  std::optional<MotionCost> motion;
  std::optional<PatternCost> pattern;
  Remarks remarks{};  // of systems that cannot be solved, of the motion's later instants and the pattern's clock
};

/// accuracy   whether the discretisation error is measured on the scene's own mesh, which is solved some times
/// throws     InputError as build_model, and where what is measured would not fit the memory
SceneCheck check_scene(const Scene& scene, bool accuracy, Progress& progress);

/// What `touchfield check` says.
Json check_value(const SceneCheck& checked);

/// What every case of a sweep would be and take, in order; or the first one of each body, of so many bodies. Models are
/// built one by one.
///
/// returns   an array of objects: case, name, inputs, sharing (cases with the same body), seconds (of the case alone),
///           memory_mib, faces, channels, solver, warnings, notes and reason (why it cannot be built;
///           numbers are then null)
Json list_cases(const SweepInput& input, std::optional<std::size_t> bodies = std::nullopt);

}  // namespace touchfield
