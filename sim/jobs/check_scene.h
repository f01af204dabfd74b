#pragma once

#include <optional>

#include "sim/core/progress.h"
#include "sim/model/warnings.h"
#include "sim/motion/play.h"
#include "sim/run/check.h"
#include "sim/run/estimates.h"

namespace touchfield {

/// What a scene would build and cost, of all its parts.
struct SceneCheck {
  Model model;  // whose plan warns of units that were guessed
  CheckReport report;
  std::optional<AccuracyReport> accuracy;
  std::optional<MotionCost> motion;
  Remarks on_the_way{};  // of the motion's later instants
};

/// accuracy   whether the discretisation error is measured on the scene's own mesh, which is solved some times
/// throws     InputError as build_model, and where what is measured would not fit the memory
SceneCheck check_scene(Scene scene, bool accuracy, Progress& progress);

/// What `touchfield check` says.
Json check_value(const SceneCheck& checked);

}  // namespace touchfield
