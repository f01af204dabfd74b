#include "sim/motion/frame_budget.h"

#include <algorithm>
#include <chrono>

#include <fmt/format.h>

#include "sim/core/units.h"
#include "sim/motion/frame_solver.h"

namespace touchfield {

namespace {

// The quickest first. Of those that scripts/frame_study tries, none is both slower and farther off than another one.
constexpr FrameSetting kSettings[] = {
    {3.0 * kMillimetre, 7.5 * kMillimetre, Scheme::kChief, 1},
    {3.0 * kMillimetre, 7.5 * kMillimetre, Scheme::kChief, 3},
    {2.4 * kMillimetre, 6.0 * kMillimetre, Scheme::kChief, 5},
    {1.7 * kMillimetre, 4.2 * kMillimetre, Scheme::kChief, 5},
    {1.7 * kMillimetre, 4.2 * kMillimetre, Scheme::kBurtonMillerPolished, 5},
};
constexpr double kWithin = 12 * kMillimetre;
constexpr double kMargin = 0.7;  // of the budget: frames on the wall clock find cold caches and sleeping threads
constexpr int kTrials = 9;
constexpr double kSway = 0.1e-3;  // from frame to frame [m]

/// A state in which a sensor that is not exact may see the skin: no two frames then have the same, also of a hand at
/// rest.
MotionState seen_state(const MovingModel& moving, double seconds, int frame) {
  MotionState state = moving.state(seconds);
  if (!is_exact(moving.first().fixed->scene.motion->sensor)) {
    state.skin = moving.at(state).body.mesh.vertices().colwise() + Vector3(frame * kSway, 0, 0);
  }
  return state;
}

/// The median time of some frames [s], without the first one, which also makes what the others keep.
double frame_seconds(Scene scene, Progress* progress) {
  scene.solve.allow_coarse_mesh = true;  // its time counts, not its result
  const MovingModel moving(scene, nullptr, progress);
  const MethodSpec& method = moving.first().fixed->scene.solve.methods.front();
  FrameSolver solver(moving, method, drives_for(ExactSensor(moving), method));
  std::vector<double> took;
  for (int i = 0; i <= kTrials; ++i) {
    const auto begin = std::chrono::steady_clock::now();
    const double instant = scene.motion->seconds * i / kTrials;
    solver.solve(moving.at(seen_state(moving, instant, i)));
    took.push_back(std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
  }
  const auto middle = took.begin() + 1 + kTrials / 2;
  std::nth_element(took.begin() + 1, middle, took.end());
  return *middle;
}

}  // namespace

FrameChoice choose_frame(const Scene& scene, Progress* progress) {
  FrameChoice choice;
  for (const FrameSetting& setting : kSettings) {
    const double milliseconds = 1e3 * frame_seconds(with_setting(scene, setting), progress);
    const bool fits = milliseconds <= 1e3 * kMargin * scene.motion->frame->budget;
    if (fits || choice.milliseconds == 0) {
      choice = {setting, milliseconds};
    }
    if (!fits) {
      break;
    }
  }
  return choice;
}

Scene within_budget(const Scene& scene, std::vector<std::string>& notes, Progress* progress) {
  if (!scene.motion || !scene.motion->frame) {
    return scene;
  }
  const FrameChoice choice = choose_frame(scene, progress);
  const double budget = 1e3 * scene.motion->frame->budget;
  notes.push_back(fmt::format(
      "frame: edges of {:.3g} and {:.3g} mm, {}, {} steps: {:.0f} ms per frame here, {} the requested {:.4g} ms",
      choice.setting.near_target / kMillimetre, choice.setting.far / kMillimetre, to_string(choice.setting.scheme),
      choice.setting.steps, choice.milliseconds, choice.milliseconds <= budget ? "within" : "NOT within", budget));
  return with_setting(scene, choice.setting);
}

Scene with_setting(const Scene& scene, const FrameSetting& setting) {
  Scene chosen = scene;
  for (BodySpec& body : chosen.bodies) {
    if (body.edge) {
      EdgeSpec edge;
      edge.near_target = setting.near_target;
      edge.far = setting.far;
      edge.within = kWithin;
      body.edge = edge;
    }
  }
  chosen.solve.scheme = setting.scheme;
  for (MethodSpec& method : chosen.solve.methods) {
    method.scheme = setting.scheme;
  }
  chosen.motion->iterations = setting.steps;
  chosen.motion->frame.reset();
  return chosen;
}

}  // namespace touchfield
