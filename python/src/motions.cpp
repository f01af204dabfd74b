#include <algorithm>

#include <fmt/format.h>
#include <omp.h>

#include "python/src/arrays.h"
#include "python/src/job.h"
#include "python/src/parts.h"
#include "sim/core/errors.h"
#include "sim/core/files.h"
#include "sim/hand/tracked_joints.h"
#include "sim/jobs/play_scene.h"
#include "sim/motion/frame_solver.h"
#include "sim/pictures/figures.h"
#include "sim/run/motion_file.h"
#include "sim/run/motion_summary.h"
#include "sim/view/view_motion.h"

namespace touchfield::python {

namespace {

using SharedMotion = Shared<Motion>;
using TablesByName = Said<"dict[str, dict[str, numpy.typing.NDArray[numpy.float64]]]">;

SharedMotion play(const SceneLike& scene, const PathLike& out, const Changes& set,
                  const std::optional<std::string>& device, bool force, std::optional<int> threads,
                  const Callback& progress) {
  const Reporting reporting(progress);
  const std::optional<std::string> folder = out.is_none() ? std::nullopt : std::optional(path_of(out));
  return computed(thread_count(threads), [input = scene_input(scene), overrides = overrides_of(set, device), folder,
                                          force](Progress& progress) {
    const Scene read = input.read(overrides);
    if (!read.motion) {
      throw InputError(fmt::format("{}: the scene has no motion: section; run() computes a still", input.name));
    }
    MotionOptions options{.command_line = "touchfield.play() of Python", .threads = omp_get_max_threads()};
    require_motion_memory(read);
    const SensedMotion sensed = sensed_motion(within_budget(read, options.notes, &progress), nullptr, &progress);
    if (!folder) {
      return shared(play_motion(sensed, options, progress));
    }
    return shared(filled(play_job(sensed, options), *folder, force, progress));
  });
}

/// A column of a table: a number of each row.
template <typename Row, typename Number>
RealArray column(const std::vector<Row>& rows, Number number) {
  Eigen::VectorXd values(static_cast<Eigen::Index>(rows.size()));
  std::ranges::transform(rows, values.begin(), number);
  return owned(std::move(values));
}

/// What frames.csv has of them, in m and s.
nb::object frames_of(const MotionMethod& method) {
  const std::vector<MotionFrame>& frames = method.frames;
  nb::dict table;
  const auto add = [&](const char* label, auto number) { table[label] = column(frames, number); };
  add("sampled_s", [](const MotionFrame& frame) { return frame.sampled; });
  add("started_s", [](const MotionFrame& frame) { return frame.started; });
  add("late_s", [](const MotionFrame& frame) { return frame.late; });
  add("shown_s", [](const MotionFrame& frame) { return frame.shown; });
  add("pose_time_s", [](const MotionFrame& frame) { return frame.pose_time; });
  add("silent", [](const MotionFrame& frame) { return frame.silent ? 1.0 : 0.0; });
  add("lost", [](const MotionFrame& frame) { return frame.lost ? 1.0 : 0.0; });
  add("skin_off_m", [](const MotionFrame& frame) { return frame.off.skin; });
  add("patch_off_m", [](const MotionFrame& frame) { return frame.off.patch; });
  add("target_off_m", [](const MotionFrame& frame) { return frame.target_off; });
  add("cost", [](const MotionFrame& frame) {
    return frame.solution.cost_history.empty() ? kNotComputed : frame.solution.cost_history.back();
  });
  add("steps", [](const MotionFrame& frame) { return static_cast<double>(frame.solution.iterations); });
  for (const std::string& stage : stages_of(frames)) {
    table[("seconds_" + stage).c_str()] =
        column(frames, [&](const MotionFrame& frame) { return stage_seconds(frame, stage); });
  }
  return named(table);
}

/// The joints of a hand tracker by their names, F x 3; nothing without one.
nb::object joints_of(const MotionMethod& method) {
  nb::dict table;
  const std::vector<MotionFrame>& frames = method.frames;
  const std::vector<std::string> names = tracked_joints();
  for (std::size_t j = 0; j < names.size() && !frames.empty() && !frames.front().joints.empty(); ++j) {
    Eigen::MatrixXd places(static_cast<Eigen::Index>(frames.size()), 3);
    for (std::size_t f = 0; f < frames.size(); ++f) {
      places.row(static_cast<Eigen::Index>(f)) = frames[f].joints[j].transpose();
    }
    table[names[j].c_str()] = owned(std::move(places));
  }
  return named(table);
}

/// What motion.csv has of them, likewise.
nb::object scores_of(const MotionMethod& method) {
  const std::vector<MotionScore>& scores = method.scores;
  nb::dict table;
  const auto add = [&](const char* label, auto number) { table[label] = column(scores, number); };
  add("time_s", [](const MotionScore& score) { return score.time; });
  add("frame", [](const MotionScore& score) { return static_cast<double>(score.frame); });
  add("age_s", [](const MotionScore& score) { return score.age; });
  add("displacement_m", [](const MotionScore& score) { return shown_displacement(score); });
  for (const MetricField& field : metric_fields()) {
    add(field.name, [&](const MotionScore& score) { return score.metrics.*field.value; });
  }
  return named(table);
}

/// A number of each channel in each frame, F x N.
RealArrays of_frames(const SharedMotion& motion, Eigen::VectorXd PhaseSolution::*part) {
  return by_method(*motion, [&](const MotionMethod& method) {
    Eigen::MatrixXd values(static_cast<Eigen::Index>(method.frames.size()), motion->array.size());
    for (Eigen::Index f = 0; f < values.rows(); ++f) {
      values.row(f) = (method.frames[static_cast<std::size_t>(f)].solution.*part).transpose();
    }
    return owned(std::move(values));
  });
}

void save(const SharedMotion& motion, const PathLike& path, bool force) {
  do_work(0, [motion, place = path_of(path), force](Progress&) {
    require_free(place, force, "force=True replaces it");
    write_motion_file(place, *motion);
  });
}

void add_class(nb::module_& module) {
  nb::class_<SharedMotion> kind(module, "Motion", "The results of a scene that moves.");
  add_results(kind, "The skin at the beginning, as the solver sees it: a `Mesh`.");
  kind.def_prop_ro(
          "duration", [](const SharedMotion& self) { return self->seconds; }, "[s]")
      .def_prop_ro(
          "scores", [](const SharedMotion& self) { return TablesByName(by_method(*self, scores_of)); },
          "By method: columns of the scores over time, as motion.csv has them, in s and m.")
      .def_prop_ro(
          "frames", [](const SharedMotion& self) { return TablesByName(by_method(*self, frames_of)); },
          "By method: columns of the frames, as frames.csv has them, in s and m.")
      .def_prop_ro(
          "joints", [](const SharedMotion& self) { return TablesByName(by_method(*self, joints_of)); },
          "By method: the joints of a hand tracker by their names of OpenXR, as index_tip, of the sample of each "
          "frame, "
          "shape (F, 3) [m]; NaN where it found no hand. Empty unless joints are the sensor.")
      .def_prop_ro(
          "phases", [](const SharedMotion& self) { return of_frames(self, &PhaseSolution::phases); },
          "By method, of every channel in each frame, shape (F, N) [rad].")
      .def_prop_ro(
          "amplitudes", [](const SharedMotion& self) { return of_frames(self, &PhaseSolution::amplitudes); },
          "By method, of every channel in each frame, shape (F, N).")
      .def_prop_ro(
          "summary",
          [](const SharedMotion& self) {
            const auto of = [](const MotionMethod& method) { return numbers_dict(summary_columns(summary(method))); };
            return NumbersByName(by_method(*self, of));
          },
          "By method: mean, median, 95th percentile and worst of every metric over the motion.")
      .def_prop_ro(
          "complete", [](const SharedMotion& self) { return self->complete; },
          "Whether the motion was played to its end.")
      .def("save", &save, nb::arg("path"), nb::arg("force") = false, R"(Writes a motion.h5.

Parameters
----------
path : str or os.PathLike
force : bool
    Whether an older file is replaced.

Examples
--------
>>> motion.save("motion.h5")  # doctest: +SKIP
)")
      .def("_page",
           [](const SharedMotion& self) {
             return computed(0, [self](Progress&) { return motion_page(*self, motion_strip(*self)); });
           })
      .def("__repr__", [](const SharedMotion& self) { return motion_table(*self); });
}

}  // namespace

void add_motions(nb::module_& module) {
  add_class(module);
  module.def("play", &play, nb::arg("scene"), nb::arg("out") = nb::none(), nb::arg("set") = nb::none(),
             nb::arg("device") = nb::none(), nb::kw_only(), nb::arg("force") = false, nb::arg("threads") = nb::none(),
             nb::arg("progress") = nb::none(),
             R"(Plays the motion of a scene on the clock of its sensor, solver and array, as `touchfield play`.

Parameters
----------
scene : str, os.PathLike or dict
    A scene with `motion`, as of `Model`.
out : str or os.PathLike, optional
    A folder for motion.h5, tables, pictures and surfaces; default: none is written.
set : dict, optional
    Changes of the scene by key path.
device : {"auto", "cpu", "cuda", "cuda:N"}, optional
force : bool
    Whether older results in the folder are replaced.
threads : int, optional
progress : callable or bool, optional

Raises
------
InputError
    If the scene has no motion, or as of `run`.

Examples
--------
>>> motion = tf.play("scenes/moving.yaml")  # doctest: +SKIP
)");
  module.def(
      "read_motion",
      [](const PathLike& path) {
        return computed(0, [file = path_of(path)](Progress& progress) {
          return shared(read_motion_file(file, [&](const std::string& text) { progress.warn(text); }));
        });
      },
      nb::arg("path"), R"(Reads a motion.h5.

Parameters
----------
path : str or os.PathLike

Examples
--------
>>> motion = tf.read_motion("motion.h5")  # doctest: +SKIP
)");
}

}  // namespace touchfield::python
