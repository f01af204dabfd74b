#include "sim/run/motion_file.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>

#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/core/require.h"
#include "sim/hand/tracked_joints.h"
#include "sim/run/motion_summary.h"
#include "sim/run/run_archive.h"
#include "sim/run/run_file.h"

namespace touchfield {

namespace {

/// Records whose first column has this name.
template <class Records>
void sized_like(const GroupReader& io, Records& records, const std::string& column) {
  Eigen::VectorXd values;
  io.list(column, values, "s");
  records.resize(static_cast<std::size_t>(values.size()));
}

/// The cost histories, which may differ in length, as rows that end in NaN.
void cost_parts(const GroupWriter& io, const std::vector<MotionFrame>& frames) {
  std::size_t longest = 0;
  std::vector<std::vector<double>> rows;
  for (const MotionFrame& frame : frames) {
    rows.push_back(frame.solution.cost_history);
    longest = std::max(longest, rows.back().size());
  }
  for (std::vector<double>& row : rows) {
    row.resize(longest, kNotComputed);
  }
  if (longest > 0) {
    io.rows("cost", rows, std::identity(), static_cast<Eigen::Index>(longest), "Pa2");
  }
}

void cost_parts(const GroupReader& io, std::vector<MotionFrame>& frames) {
  if (!io.has("cost")) {
    return;
  }
  const hdf5::Shape extent = io.shape("cost");
  if (extent.size() != 2) {
    io.fail("cost must be [frames, n]");
  }
  io.rows(
      "cost", frames, [](MotionFrame & frame) -> auto& { return frame.solution.cost_history; },
      static_cast<Eigen::Index>(extent[1]), "Pa2");
  for (MotionFrame& frame : frames) {
    std::vector<double>& costs = frame.solution.cost_history;
    const auto last = std::find_if_not(costs.rbegin(), costs.rend(), [](double cost) { return std::isnan(cost); });
    costs.erase(last.base(), costs.end());
  }
}

/// A dataset a stage; NaN in frames that were without it.
void stage_parts(const GroupWriter& io, const std::vector<MotionFrame>& frames) {
  for (const std::string& stage : stages_of(frames)) {
    std::vector<double> values;
    std::ranges::transform(frames, std::back_inserter(values),
                           [&](const MotionFrame& frame) { return stage_seconds(frame, stage); });
    io.list(stage, values, "s");
  }
}

void stage_parts(const GroupReader& io, std::vector<MotionFrame>& frames) {
  for (const std::string& stage : io.names()) {
    std::vector<double> values;
    io.list(stage, values, "s");
    require_size(io.place() + ": " + stage, static_cast<Eigen::Index>(values.size()),
                 static_cast<Eigen::Index>(frames.size()));
    for (std::size_t i = 0; i < frames.size(); ++i) {
      if (!std::isnan(values[i])) {
        frames[i].seconds.emplace_back(stage, values[i]);
      }
    }
  }
}

/// The joints of a hand tracker, a dataset each.
template <class Io, class Frames>
void joint_parts(const Io& io, Frames& frames) {
  const std::vector<std::string> names = tracked_joints();
  if constexpr (Io::kReads) {
    for (MotionFrame& frame : frames) {
      frame.joints.resize(names.size());
    }
  }
  for (std::size_t j = 0; j < names.size(); ++j) {
    io.rows(
        names[j], frames, [j](auto& frame) -> auto& { return frame.joints[j]; }, 3, "m");
  }
}

template <class Io, class Frames>
void frame_parts(const Io& io, Frames& frames, Eigen::Index channels) {
  if constexpr (Io::kReads) {
    sized_like(io, frames, "sampled");
  }
  io.column("sampled", frames, &MotionFrame::sampled, "s");
  io.column("started", frames, &MotionFrame::started, "s");
  io.column("late", frames, &MotionFrame::late, "s");
  io.column("shown", frames, &MotionFrame::shown, "s");
  io.column("pose_time", frames, &MotionFrame::pose_time, "s");
  io.column("silent", frames, &MotionFrame::silent, "1");
  io.later_column("lost", frames, &MotionFrame::lost, "1");
  io.later_column(
      "skin_off", frames, [](auto& frame) -> auto& { return frame.off.skin; }, "m");
  io.later_column(
      "patch_off", frames, [](auto& frame) -> auto& { return frame.off.patch; }, "m");
  io.later_column("target_off", frames, &MotionFrame::target_off, "m");
  io.column(
      "steps", frames, [](auto& frame) -> auto& { return frame.solution.iterations; }, "1");
  io.choice_column(
      "status", frames, [](auto& frame) -> auto& { return frame.solution.status; }, status_choices());
  io.rows(
      "phases", frames, [](auto& frame) -> auto& { return frame.solution.phases; }, channels, "rad");
  io.rows(
      "amplitudes", frames, [](auto& frame) -> auto& { return frame.solution.amplitudes; }, channels, "1");
  io.part("joints", !frames.empty() && !frames.front().joints.empty(),
          [&](const Io& part) { joint_parts(part, frames); });
  cost_parts(io, frames);
  io.part("seconds", !stages_of(frames).empty(), [&](const Io& part) { stage_parts(part, frames); });
}

template <class Io, class Scores>
void score_parts(const Io& io, Scores& scores) {
  if constexpr (Io::kReads) {
    sized_like(io, scores, "time");
  }
  io.column("time", scores, &MotionScore::time, "s");
  io.column("frame", scores, &MotionScore::frame, "1");
  io.column("age", scores, &MotionScore::age, "s");
  io.rows("displacement", scores, &MotionScore::displacement, 3, "m");
  for (const MetricField& field : metric_fields()) {
    io.later_column(
        field.name, scores, [value = field.value](auto& score) -> auto& { return score.metrics.*value; }, field.unit);
  }
}

/// All but what is said of the motion in the root itself, and its meshes.
template <class Io, class TheMotion>
void motion_parts(const Io& io, TheMotion& motion) {
  io.part("array", true, [&](const Io& part) { array_parts(part, motion.array); });
  io.part("methods", !motion.methods.empty(), [&](const Io& methods) {
    methods.parts(
        motion.methods, [](auto& method) -> auto& { return method.name; },
        [&](const Io& part, auto& method) {
          part.attribute("method", method.method);
          part.attribute("scheme", method.scheme);
          part.attribute("dropped", method.dropped);
          part.part("frames", true, [&](const Io& frames) { frame_parts(frames, method.frames, motion.array.size()); });
          part.part("scores", true, [&](const Io& scores) { score_parts(scores, method.scores); });
        });
  });
  io.part("seconds", !motion.timings.empty(), [&](const Io& part) { part.stages("", motion.timings); });
  io.optional_texts("warnings", motion.warnings);
  io.optional_texts("notes", motion.notes);
  io.part("provenance", true, [&](const Io& part) { provenance_parts(part, motion.provenance); });
}

void write_motion(const GroupWriter& io, const Motion& motion) {
  format_parts(io, kMotionArchive);
  io.attribute("name", motion.name);
  io.attribute("complete", motion.complete ? 1 : 0);
  io.attribute("seconds", motion.seconds);
  io.write_text("scene", motion.scene);
  io.part("mesh", true, [&](const GroupWriter& part) { mesh_parts(part, motion.mesh); });
  io.part("evaluation", motion.evaluation.has_value(), [&](const GroupWriter& evaluation) {
    evaluation.part("mesh", true, [&](const GroupWriter& part) { mesh_parts(part, *motion.evaluation); });
  });
  motion_parts(io, motion);
  extent_parts(io, motion);
}

Motion read_motion(const GroupReader& io) {
  require_groups(io);
  Motion motion{.name = io.text_attribute("name"),
                .scene = io.read_text("scene"),
                .seconds = io.number_attribute("seconds"),
                .mesh = read_mesh(GroupReader(io.open("mesh"))),
                .complete = io.integer_attribute("complete") != 0};
  if (io.has("evaluation")) {
    motion.evaluation = read_mesh(GroupReader(io.open("evaluation").open("mesh")));
  }
  motion_parts(io, motion);
  extent_parts(io, motion);
  return motion;
}

void check_frame(const std::string& what, const MotionFrame& frame, Eigen::Index channels) {
  require_size(what + ": phases", frame.solution.phases.size(), channels);
  require_size(what + ": amplitudes", frame.solution.amplitudes.size(), channels);
  std::set<std::string> stages;
  for (const auto& [stage, seconds] : frame.seconds) {
    require_name(what + ": stage", stage, stages);
    require(seconds >= 0, "{}: stage '{}' = {} s must be >= 0", what, stage, seconds);
  }
}

}  // namespace

void check_motion(const Motion& motion) {
  check_array(motion.array);
  require_stages("motion", motion.timings);
  std::set<std::string> names;
  for (const MotionMethod& method : motion.methods) {
    require_name("method", method.name, names);
    const std::string what = "method " + method.name;
    for (std::size_t i = 0; i < method.frames.size(); ++i) {
      check_frame(fmt::format("{}: frame {}", what, i), method.frames[i], motion.array.size());
    }
    for (std::size_t i = 0; i < method.scores.size(); ++i) {
      if (const int frame = method.scores[i].frame; frame < -1 || frame >= static_cast<int>(method.frames.size())) {
        throw InputError(fmt::format("{}: score {}: frame {} must be in -1..{}", what, i, frame,
                                     static_cast<int>(method.frames.size()) - 1));
      }
    }
    require(method.dropped >= 0, "{}: dropped = {} must be >= 0", what, method.dropped);
  }
}

void check_instant(const MotionInstant& instant) {
  if (instant.target) {
    check_target("target", *instant.target, instant.mesh.face_count());
  }
  for (const auto& [method, pressure] : instant.pressure) {
    require_size(fmt::format("method {}: pressure", method), pressure.size(), instant.mesh.face_count());
  }
}

std::string result_file_at(const std::string& path) {
  const std::filesystem::path folder = path;
  for (const char* name : {"run.h5", "motion.h5", "pattern.h5"}) {
    if (std::filesystem::exists(folder / name)) {
      return (folder / name).string();
    }
  }
  return run_file_at(path);
}

void write_motion_file(const std::string& path, const Motion& motion) {
  check_motion(motion);
  const hdf5::MemoryFile file(path);
  write_motion(GroupWriter(file.root()), motion);
  write_archive(path, file);
}

Motion read_motion_file(const std::string& path, const Warn& warn) {
  Motion motion = read_motion(GroupReader(read_archive(path, kMotionArchive, warn)));
  require_undamaged(path, [&] { check_motion(motion); });
  return motion;
}

}  // namespace touchfield
