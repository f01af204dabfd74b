#pragma once

#include <numbers>

#include "sim/hand/tracked_joints.h"
#include "sim/run/motion_data.h"
#include "tests/support/output_support.h"

/// Motions that nobody computed.
namespace touchfield {
inline namespace support {

inline MotionFrame made_up_frame(int number, Eigen::Index channels, double seed) {
  MotionFrame frame;
  frame.off.skin = 0.3e-3;
  frame.target_off = 0.7e-3;
  frame.joints.assign(seed > 0 ? tracked_joints().size() : 0, Vector3(0.1 + number, seed, 1.0 / 3));
  frame.sampled = number / 30.0;
  frame.started = number / 20.0 + 1e-3;
  frame.late = number == 2 ? 0.004 : 0.0;
  frame.shown = frame.started + 0.021;
  frame.pose_time = frame.sampled + 0.05;
  frame.solution.phases = made_up_pressure(channels, seed + number).cwiseAbs() / 400.0;
  frame.solution.amplitudes = Eigen::VectorXd::Ones(channels);
  frame.solution.cost_history = {3.0 + seed, 2.0, 1.0 / (3 + number)};
  frame.solution.iterations = 2;
  frame.solution.status = PhaseStatus::kIterationLimit;
  frame.seconds = {{"pose", 1e-3 / 3}, {"factorisation", 0.01 + 1e-3 * number}};
  return frame;
}

/// Three instants of a skin that rises: with all there is, without the sensed skin and the target, and in silence.
inline void add_instants(Motion& motion, const std::optional<Target>& target) {
  const auto risen = [](const TriangleMesh& mesh, double height) {
    return transformed(mesh, Eigen::Matrix3d::Identity(), Vector3(0, 0, height));
  };
  const TriangleMesh& skin = evaluated_mesh(motion);
  for (int i = 0; i < 3; ++i) {
    MotionInstant& instant = motion.instants.emplace_back(MotionInstant{
        .time = motion.methods.front().scores[static_cast<std::size_t>(2 * i)].time, .mesh = risen(skin, 1e-3 * i)});
    if (i == 0) {
      instant.target = target;
      instant.sensed = risen(motion.mesh, 3e-4);
    }
    for (const MotionMethod& method : motion.methods) {
      instant.pressure.emplace_back(method.name, made_up_pressure(skin.face_count(), i * 0.7) * (i < 2 ? 1.0 : 0.0));
    }
  }
}

/// A motion with something in every place: an evaluation mesh, two methods, one of which has silent frames and dropped
/// ones and scores before its first frame.
inline Motion full_motion() {
  const Run run = full_run();
  Motion motion{.name = "wave \xc3\xbc",
                .scene = run.scene,
                .seconds = 0.2,
                .array = run.array,
                .radiation_per_square = run.radiation_per_square,
                .mesh = run.mesh,
                .evaluation = run.evaluation_model->mesh,
                .timings = {{"mesh", 0.125}, {"evaluation", 1.0 / 7.0}},
                .warnings = run.warnings,
                .notes = run.notes,
                .provenance = run.provenance,
                .complete = true};
  for (const char* name : {"surface", "paper-2"}) {
    MotionMethod& method = motion.methods.emplace_back();
    method.name = name;
    method.method = "surface";
    method.scheme = "chief";
    const double seed = motion.methods.size() == 1 ? 0.25 : 7.5;
    for (int i = 0; i < 4; ++i) {
      method.frames.push_back(made_up_frame(i, motion.array.size(), seed));
    }
    for (int i = 0; i < 6; ++i) {
      MotionScore& score = method.scores.emplace_back();
      score.time = i / 61.0;
      score.frame = i - 2 < 0 ? -1 : i - 2;
      if (score.frame >= 0) {
        score.age = 0.02 + 1e-3 * i / 3;
        score.displacement = Vector3(1e-3 / 3, -2e-3, 1e-4 * i);
        score.metrics.relative_error = 0.3 + 0.1 * i + 0.01 * seed;
        score.metrics.mean_inside_pa = 1000.0 + 100.0 * i;
      }
    }
  }
  MotionMethod& other = motion.methods[1];
  other.dropped = 3;
  MotionFrame& silent = other.frames[1];
  silent.silent = true;
  silent.lost = true;
  silent.solution = {.phases = Eigen::VectorXd::Zero(motion.array.size()),
                     .amplitudes = Eigen::VectorXd::Zero(motion.array.size()),
                     .cost_history = {},
                     .iterations = 0,
                     .status = PhaseStatus::kDirect};
  silent.seconds = {{"pose", 2e-3 / 3}};
  other.frames[2].solution.cost_history.push_back(0.125);
  other.watched = {{"index_pad", made_up_pressure(6, 3.0).cwiseAbs()}};
  add_instants(motion, run.evaluation_model->target);
  motion.patch = {.skin = skin_patch(*motion.evaluation, 1),
                  .radiation = {},
                  .rate = 20.0,
                  .points = {{"start", Vector3(1e-3 / 3, 0, 0.2)}, {"opposite", Vector3(-1e-3, 0, 0.2)}}};
  motion.patch->radiation = Eigen::MatrixXd::Constant(motion.patch->skin.size(), 4, 0.1);
  motion.patch->radiation(0, 2) = -1.0 / 3.0;
  return motion;
}

/// The same at work: a method a name, two seconds of a finger that goes to and fro, error and displacement in step.
inline Motion long_motion(const std::vector<std::string>& names) {
  Motion motion = full_motion();
  motion.name = "to and fro";
  motion.seconds = 2.0;
  motion.methods.clear();
  motion.instants.clear();
  motion.patch.reset();
  for (const std::string& name : names) {
    MotionMethod& method = motion.methods.emplace_back();
    method.name = name;
    method.method = name;
    const auto number = static_cast<double>(motion.methods.size());
    method.frames.push_back(made_up_frame(0, motion.array.size(), number));
    for (int i = 0; i < 122; ++i) {
      MotionScore& score = method.scores.emplace_back();
      score.time = i / 61.0;
      score.frame = i < 2 ? -1 : 0;
      const double off =
          2e-3 * std::sin(2.0 * std::numbers::pi * score.time) * (1.0 + 0.3 * std::sin(40.0 * score.time));
      const bool silent = i >= 60 && i <= 70;  // there is no patch that could be displaced
      score.displacement = Vector3(silent ? kNotComputed : off, 0, 0);
      if (score.frame == 0 && !silent) {
        score.age = 0.05;
        score.metrics.relative_error = 0.35 + 0.1 * number + 60.0 * std::abs(off);
        score.metrics.mean_inside_pa = 3200.0 - 300.0 * number - 4e5 * std::abs(off);
      }
    }
  }
  return motion;
}

}  // namespace support
}  // namespace touchfield
