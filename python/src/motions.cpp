#include <algorithm>
#include <cmath>
#include <iterator>

#include <fmt/format.h>
#include <omp.h>

#include "python/src/arrays.h"
#include "python/src/job.h"
#include "python/src/parts.h"
#include "sim/core/errors.h"
#include "sim/core/files.h"
#include "sim/hand/tracked_joints.h"
#include "sim/jobs/pattern_scene.h"
#include "sim/jobs/play_scene.h"
#include "sim/jobs/run_model.h"
#include "sim/motion/frame_solver.h"
#include "sim/motion/pattern.h"
#include "sim/pictures/figures.h"
#include "sim/run/motion_file.h"
#include "sim/run/motion_summary.h"
#include "sim/view/view_motion.h"

namespace touchfield::python {

namespace {

using SharedMotion = Shared<Motion>;
using AnyMotion = Said<"Motion">;
using TablesByName = Said<"dict[str, dict[str, numpy.typing.NDArray[numpy.float64]]]">;
using PlacesByName = Said<"dict[str, numpy.typing.NDArray[numpy.float64]]">;
using TwoArrays = Said<"tuple[numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.float64]]">;

/// A column of a table: a number of each row.
template <typename Row, typename Number>
RealArray column(const std::vector<Row>& rows, Number number) {
  Eigen::VectorXd values(static_cast<Eigen::Index>(rows.size()));
  std::ranges::transform(rows, values.begin(), number);
  return owned(std::move(values));
}

/// A motion that has a patch.
struct SharedPattern : SharedMotion {};

std::optional<std::string> folder_of(const PathLike& out) {
  return out.is_none() ? std::nullopt : std::optional(path_of(out));
}

SharedPattern pattern(const SceneLike& scene, const Changes& set, const std::optional<std::string>& device,
                      std::optional<int> check, const PathLike& out, bool force, std::optional<int> threads,
                      const Callback& progress) {
  if (check && *check < 1) {
    throw InputError(fmt::format("pattern: check = {} must be 1 or more", *check));
  }
  const Reporting reporting(progress);
  return {computed(thread_count(threads), [input = scene_input(scene), overrides = overrides_of(set, device), check,
                                           folder = folder_of(out), force](Progress& progress) {
    const Scene read = input.read(overrides);
    if (!read.pattern) {
      throw InputError(fmt::format("{}: the scene has no pattern: section; run() computes a still", input.name));
    }
    pattern_clock(*read.pattern);
    const Model model = build_model(read);
    require_memory(pattern_cost(model));
    const PatternOptions options{
        .command_line = "touchfield.pattern() of Python", .threads = omp_get_max_threads(), .check = check};
    return shared(folder ? filled(pattern_job(model, options), *folder, force, progress).motion
                         : solve_pattern(model, options, progress).motion);
  })};
}

/// Of the radiation pressure at a point, as spectrum.csv has it.
TwoArrays spectrum(const SharedPattern& pattern, const std::string& point, double highest) {
  const auto& watched = pattern->methods.front().watched;
  const auto found = std::ranges::find(watched, point, [](const auto& each) { return each.first; });
  if (found == watched.end()) {
    std::vector<std::string> names;
    std::ranges::transform(watched, std::back_inserter(names), [](const auto& each) { return each.first; });
    throw InputError(fmt::format("spectrum: point = '{}' must be one of {}", point, fmt::join(names, ", ")));
  }
  if (!(highest > 0 && highest <= kHighestLine)) {
    throw InputError(fmt::format("spectrum: highest = {} must be above 0 and at most {} Hz", highest, kHighestLine));
  }
  const Eigen::VectorXd radiation = pattern->radiation_per_square * found->second.cwiseAbs2();
  const std::vector<SpectralLine> lines = lines_of_held(radiation, pattern->patch->rate, highest);
  return nb::make_tuple(column(lines, [](const SpectralLine& line) { return line.hz; }),
                        column(lines, [](const SpectralLine& line) { return std::sqrt(line.mean_square); }));
}

SharedMotion play(const SceneLike& scene, const PathLike& out, const Changes& set,
                  const std::optional<std::string>& device, bool force, std::optional<int> threads,
                  const Callback& progress) {
  const Reporting reporting(progress);
  return computed(thread_count(threads), [input = scene_input(scene), overrides = overrides_of(set, device),
                                          folder = folder_of(out), force](Progress& progress) {
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

void add_pattern(nb::module_& module) {
  nb::class_<SharedPattern, SharedMotion>(module, "Pattern",
                                          R"(One pass of a pattern that repeats: a `Motion` of one method.

Its `frames` is a function, of phases and amplitudes for a device.)")
      .def_prop_ro(
          "frames_per_second", [](const SharedPattern& self) { return self->patch->rate; }, "[Hz]")
      .def_prop_ro(
          "points",
          [](const SharedPattern& self) {
            nb::dict places;
            for (const auto& [name, at] : self->patch->points) {
              places[name.c_str()] = owned(Eigen::VectorXd(at));
            }
            return PlacesByName(places);
          },
          "Places on the skin by name, those of `watch` and the pattern's own, shape (3,) [m].")
      .def_prop_ro(
          "patch",
          [](nb::handle_t<SharedPattern> self) {
            return flat(nb::cast<const SharedPattern&>(self)->patch->skin, self);
          },
          "The skin about the middle of the path laid flat, as of `Felt`.")
      .def_prop_ro(
          "radiation",
          [](nb::handle_t<SharedPattern> self) {
            return turned(nb::cast<const SharedPattern&>(self)->patch->radiation, self);
          },
          "The radiation pressure on the faces of `patch` in each frame, shape (F, K) [Pa]: > 0 pushes inwards.")
      .def("spectrum", &spectrum, nb::arg("point"), nb::arg("highest") = kHighestLine,
           R"(The spectrum of the radiation pressure at a point, as spectrum.csv has it.

Parameters
----------
point : str
    Of `points`.
highest : float
    The last frequency [Hz].

Returns
-------
hz, rms : numpy.ndarray
    Of the lines [Hz, Pa]. Lines closer than 0.1 Hz share one.

Examples
--------
>>> hz, rms = pattern.spectrum("start")  # doctest: +SKIP
)");
}

constexpr const char* kPatternText =
    R"(Solves a pattern that repeats on a still hand, frame by frame, as `touchfield pattern`.

Parameters
----------
scene : str, os.PathLike or dict
    A scene with `pattern`, as of `Model`.
check : int, optional
    Each of how many frames is solved by itself too. A warning says if the sequence is worse.
out : str or os.PathLike, optional
    A folder for pattern.h5, tables and pictures; default: none is written.
set, device, force, threads, progress
    As of `play`.

Raises
------
InputError
    If the scene has no pattern, or as of `run`.

Examples
--------
>>> circle = {"pattern": {**tf.circle("bottom", 3e-3, 100), "pressure_pa": 500}}
>>> pattern = tf.pattern("capsule", set=circle)
>>> phases, amplitudes = pattern.frames()
>>> phases.shape
(10, 256)
)";

}  // namespace

void add_motions(nb::module_& module) {
  add_class(module);
  add_pattern(module);
  module.def("pattern", &pattern, nb::arg("scene"), nb::arg("set") = nb::none(), nb::arg("device") = nb::none(),
             nb::kw_only(), nb::arg("check") = nb::none(), nb::arg("out") = nb::none(), nb::arg("force") = false,
             nb::arg("threads") = nb::none(), nb::arg("progress") = nb::none(), kPatternText);
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
        const SharedMotion motion = computed(0, [file = path_of(path)](Progress& progress) {
          return shared(read_motion_file(file, [&](const std::string& text) { progress.warn(text); }));
        });
        return AnyMotion(motion->patch ? nb::cast(SharedPattern{motion}) : nb::cast(motion));
      },
      nb::arg("path"), R"(Reads a motion.h5, or a pattern.h5, which is a `Pattern`.

Parameters
----------
path : str or os.PathLike

Examples
--------
>>> motion = tf.read_motion("motion.h5")  # doctest: +SKIP
)");
}

}  // namespace touchfield::python
