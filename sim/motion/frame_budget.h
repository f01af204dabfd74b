#pragma once

#include <string>
#include <vector>

#include "sim/core/progress.h"
#include "sim/scene/scene.h"

namespace touchfield {

/// A way to compute a frame.
struct FrameSetting {
  double near_target = 0;  // edges at the target and beyond [m]
  double far = 0;
  Scheme scheme = Scheme::kChief;
  int steps = 0;
};

struct FrameChoice {
  FrameSetting setting;
  double milliseconds = 0;  // of a frame, as measured here
};

/// Chooses one of five settings, from the quickest to the most accurate. Each is tried with some frames of this scene
/// by its first method, until one takes too long. The choice is the last setting with frames of at most 0.7 of
/// motion.frame.budget_ms here, or else the quickest.
///
/// scene      with motion.frame
/// progress   hears of what takes its time; may be null
/// throws     as MovingModel and FrameSolver
FrameChoice choose_frame(const Scene& scene, Progress* progress = nullptr);

/// The scene with the setting that choose_frame chose, and a note of what that means; the scene itself without
/// motion.frame.
Scene within_budget(const Scene& scene, std::vector<std::string>& notes, Progress* progress = nullptr);

/// The scene with a setting in it: edges of every body that has some, scheme and iterations.
Scene with_setting(const Scene& scene, const FrameSetting& setting);

}  // namespace touchfield
