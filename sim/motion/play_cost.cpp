#include <algorithm>
#include <cmath>
#include <utility>

#include "sim/core/require.h"
#include "sim/model/stages.h"
#include "sim/motion/frame_solver.h"
#include "sim/motion/loop_clock.h"
#include "sim/motion/play.h"
#include "sim/motion/scorer.h"
#include "sim/run/estimates.h"

namespace touchfield {

namespace {

constexpr double kMebibyte = 1024.0 * 1024.0;

/// What is kept of a motion's frames and scores.
double kept_bytes(const Scene& scene, Eigen::Index channels) {
  const MotionSpec& motion = *scene.motion;
  const double frame = 16.0 * static_cast<double>(channels) + sizeof(MotionFrame);
  return static_cast<double>(scene.solve.methods.size()) * motion.seconds *
         (motion.frames_hz * frame + motion.score_hz * sizeof(MotionScore));
}

}  // namespace

void require_motion_memory(const Scene& scene) {
  const Wave wave(build_medium(scene.medium, scene.frequency), scene.frequency);
  const double needed = kept_bytes(scene, build_array(scene.array, wave).size());
  const double free = available_memory();
  require(!(free > 0 && needed > free),
          "motion: {:g} s of {:g} frames and {:g} scores per second need {:.1f} GiB of memory; {:.1f} GiB are free: "
          "lower motion.seconds, frames_hz or score_hz",
          scene.motion->seconds, scene.motion->frames_hz, scene.motion->score_hz, needed / (1024.0 * kMebibyte),
          free / (1024.0 * kMebibyte));
}

MotionCost expected_cost(const SensedMotion& sensed, Progress* progress) {
  const Scene& scene = sensed.scene;
  const MotionSpec& motion = *scene.motion;
  MotionCost cost;
  cost.frames = static_cast<std::int64_t>(std::ceil(motion.seconds * motion.frames_hz));
  cost.scores = static_cast<std::int64_t>(std::ceil(motion.seconds * motion.score_hz));
  const auto methods = static_cast<double>(scene.solve.methods.size());
  // The first time makes what later ones keep. Of work that takes long that is little.
  constexpr double kLong = 1.0;
  const auto timed_twice = [](const auto& work) {
    const double begin = steady_now();
    work(0.0);
    const double first = steady_now() - begin;
    if (first > kLong) {
      return std::pair(first, first);
    }
    const double again = steady_now();
    work(0.1);
    return std::pair(first, steady_now() - again);
  };
  MotionSensor& sensor = *sensed.sensor;
  const MovingModel& solved = sensor.solved();
  if (sensor.remembers()) {
    Progress silent;
    std::vector<std::pair<std::string, double>> taken;
    timed(progress != nullptr ? *progress : silent, taken, "", "sensor learning before the clock starts",
          [&] { sensor.start(progress != nullptr ? *progress : silent); });
    cost.seconds += taken.front().second;
  }
  std::int64_t number = 0;
  cost.sample = timed_twice([&](double /*share*/) {
                  sensor.sample(number, to_seconds(instant(number, motion.sensor.hz)));
                  ++number;
                }).second;
  const double samples =
      sensor.remembers() || motion.predict != MotionSpec::Prediction::kNone
          ? std::ceil(motion.seconds * motion.sensor.hz)
          : static_cast<double>(std::min(cost.frames, last_instant(to_ticks(motion.seconds), motion.sensor.hz)));
  FrameSolver solver(solved, scene.solve.methods.front(), {});
  const auto [first_frame, frame] =
      timed_twice([&](double share) { solver.solve(solved.at(solved.state(share * motion.seconds))); });
  cost.seconds += samples * cost.sample + methods * (first_frame + static_cast<double>(cost.frames - 1) * frame);
  if (sensed.truth && scene.evaluation.kind != EvaluationSpec::Kind::kNone) {
    Scorer scorer(*sensed.truth);
    const Eigen::MatrixXcd drives = Eigen::MatrixXcd::Ones(solved.first().fixed->array.size(),
                                                           static_cast<Eigen::Index>(scene.solve.methods.size()));
    const auto [first_score, score] = timed_twice([&](double share) { scorer.at(share * motion.seconds, drives); });
    cost.seconds += first_score + static_cast<double>(cost.scores - 1) * score;
  }
  cost.memory_mib = kept_bytes(scene, solved.first().fixed->array.size()) / kMebibyte;
  return cost;
}

}  // namespace touchfield
