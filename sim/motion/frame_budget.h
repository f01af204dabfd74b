#pragma once

#include <string>
#include <vector>

#include "sim/core/progress.h"
#include "sim/scene/scene.h"

namespace touchfield {

/// A way to compute a frame, and what it gave on a fingertip below 1,496 channels.
struct FrameSetting {
  double near_target;  // edges at the target and beyond [m]
  double far;
  Scheme scheme;
  int steps;
  double milliseconds;  // of a frame, on the two cores that the table is of
  double above_best;    // judged error above that of 30 steps on the finest mesh
};

/// Some that no other one beats in both time and error, the quickest first: of the front of results/tables/frame_study.csv,
/// which a test holds them to, those that each are nearer than the one before by a tenth.
const std::vector<FrameSetting>& frame_settings();

struct FrameChoice {
  FrameSetting setting;
  double milliseconds = 0;  // expected here
};

/// The nearest setting whose frames take at most 0.8 of motion.frame.budget_ms here, or else the quickest: how fast this
/// machine is with this scene's body, array and first method is told by frames of the quickest one.
///
/// scene      with motion.frame
/// progress   hears of what takes its time; may be null
/// throws     as MovingModel and FrameSolver
FrameChoice choose_frame(const Scene& scene, Progress* progress = nullptr);

/// The scene with the setting that choose_frame chose, and a note of what that means; the scene itself without motion.frame.
Scene within_budget(const Scene& scene, std::vector<std::string>& notes, Progress* progress = nullptr);

/// The scene with a setting in it: edges of every body that has some, scheme and iterations.
Scene with_setting(const Scene& scene, const FrameSetting& setting);

}  // namespace touchfield
