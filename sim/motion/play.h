#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "sim/core/progress.h"
#include "sim/motion/motion_sensor.h"
#include "sim/run/motion_data.h"

namespace touchfield {

struct MotionOptions {
  std::string command_line;                                          // kept as provenance
  int threads = 1;                                                   // likewise; the caller has set them
  std::vector<std::string> notes{};                                  // of the motion from its beginning on
  std::function<void(const Motion&)> second = [](const Motion&) {};  // gets the motion so far after each second of it
  std::function<void(const MotionInstant&)> scored = [](const MotionInstant&) {};  // after each score by an evaluation
};

/// Refuses a motion whose frames and scores would not fit the memory that is free now.
///
/// scene    with a motion
/// throws   InputError naming what they need and what there is
void require_motion_memory(const Scene& scene);

/// What playing a motion takes.
struct MotionCost {
  std::int64_t frames = 0;  // of a method
  std::int64_t scores = 0;
  double seconds = 0;     // about: from two samples, two frames of the first method and two scores, which it computes
  double sample = 0;      // of them, about what one sample takes
  double memory_mib = 0;  // beside that of the still: what is kept of frames and scores
};
/// progress   hears of what takes its time; may be null
MotionCost expected_cost(const SensedMotion& sensed, Progress* progress = nullptr);

/// Plays a motion on the clock of its sensor, solver and array (loop_clock.h). Every method of the scene finds phases
/// for what the sensor saw. What the array then emits is evaluated on the true skin, by the scene's evaluation, at
/// motion.score_hz. Where nobody knows the truth there are no scores, and a note says so. A sample that is lost makes a
/// silent frame. Some instants of scores are kept, evenly over the motion (motion_instants.h).
///
/// Where motion.solve_ms is a number the result repeats to the last bit on as many threads.
///
/// throws   NumericalError as FrameSolver and the evaluation, InputError as the sensor, and what the options' functions
///          throw
Motion play_motion(const SensedMotion& sensed, const MotionOptions& options, Progress& progress);

}  // namespace touchfield
