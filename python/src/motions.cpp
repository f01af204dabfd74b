#include <algorithm>
#include <filesystem>

#include <fmt/format.h>
#include <omp.h>

#include "python/src/arrays.h"
#include "python/src/job.h"
#include "python/src/parts.h"
#include "sim/core/errors.h"
#include "sim/core/files.h"
#include "sim/jobs/play_scene.h"
#include "sim/motion/frame_solver.h"
#include "sim/run/motion_file.h"
#include "sim/run/motion_summary.h"

namespace touchfield::python {

namespace {

using SharedMotion = Shared<Motion>;

SharedMotion play(nb::handle scene, nb::handle out, nb::handle set, const std::optional<std::string>& device,
                  bool force, std::optional<int> threads) {
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

const MotionMethod& method_of(const Motion& motion, const std::string& name) {
  const auto found = std::ranges::find(motion.methods, name, &MotionMethod::name);
  if (found == motion.methods.end()) {
    throw InputError(fmt::format("motion {}: it has no method '{}'", motion.name, name));
  }
  return *found;
}

/// A column of a table: a number of each row.
template <typename Row, typename Number>
nb::object column(const std::vector<Row>& rows, Number number) {
  Eigen::VectorXd values(static_cast<Eigen::Index>(rows.size()));
  std::ranges::transform(rows, values.begin(), number);
  return owned(std::move(values));
}

/// What frames.csv has of them, in m and s.
nb::dict frames_of(const SharedMotion& motion, const std::string& name) {
  const std::vector<MotionFrame>& frames = method_of(*motion, name).frames;
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
  return table;
}

/// What motion.csv has of them, likewise.
nb::dict scores_of(const SharedMotion& motion, const std::string& name) {
  const std::vector<MotionScore>& scores = method_of(*motion, name).scores;
  nb::dict table;
  const auto add = [&](const char* label, auto number) { table[label] = column(scores, number); };
  add("time_s", [](const MotionScore& score) { return score.time; });
  add("frame", [](const MotionScore& score) { return static_cast<double>(score.frame); });
  add("age_s", [](const MotionScore& score) { return score.age; });
  add("displacement_m", [](const MotionScore& score) { return shown_displacement(score); });
  for (const MetricField& field : metric_fields()) {
    add(field.name, [&](const MotionScore& score) { return score.metrics.*field.value; });
  }
  return table;
}

/// A number of each channel in each frame, F x N.
nb::object of_frames(const SharedMotion& motion, const std::string& name, Eigen::VectorXd PhaseSolution::*part) {
  const std::vector<MotionFrame>& frames = method_of(*motion, name).frames;
  Eigen::MatrixXd values(static_cast<Eigen::Index>(frames.size()), motion->array.size());
  for (Eigen::Index f = 0; f < values.rows(); ++f) {
    values.row(f) = (frames[static_cast<std::size_t>(f)].solution.*part).transpose();
  }
  return owned(std::move(values));
}

void save(const SharedMotion& motion, nb::handle path, bool force) {
  do_work(0, [motion, place = path_of(path), force](Progress&) {
    if (!force && std::filesystem::exists(place)) {
      throw InputError(fmt::format("{}: the file exists; force=True replaces it", place));
    }
    write_motion_file(place, *motion);
  });
}

void add_class(nb::module_& module) {
  nb::class_<SharedMotion>(module, "Motion", "The results of a scene that moves.")
      .def_prop_ro("name", [](const SharedMotion& self) { return self->name; })
      .def_prop_ro("scene", [](const SharedMotion& self) { return self->scene; })
      .def_prop_ro("duration", [](const SharedMotion& self) { return self->seconds; })
      .def_prop_ro("mesh", [](const SharedMotion& self) { return SkinMesh{part_of(self, self->mesh)}; })
      .def_prop_ro("array", [](const SharedMotion& self) { return part_of(self, self->array); })
      .def_prop_ro("methods",
                   [](const SharedMotion& self) {
                     std::vector<std::string> names;
                     std::ranges::transform(self->methods, std::back_inserter(names), &MotionMethod::name);
                     return names;
                   })
      .def("frames", &frames_of, nb::arg("method"))
      .def("scores", &scores_of, nb::arg("method"))
      .def(
          "phases",
          [](const SharedMotion& self, const std::string& method) {
            return of_frames(self, method, &PhaseSolution::phases);
          },
          nb::arg("method"))
      .def(
          "amplitudes",
          [](const SharedMotion& self, const std::string& method) {
            return of_frames(self, method, &PhaseSolution::amplitudes);
          },
          nb::arg("method"))
      .def(
          "summary",
          [](const SharedMotion& self, const std::string& method) {
            return numbers_dict(summary_columns(summary(method_of(*self, method))));
          },
          nb::arg("method"))
      .def_prop_ro("warnings", [](const SharedMotion& self) { return self->warnings; })
      .def_prop_ro("notes", [](const SharedMotion& self) { return self->notes; })
      .def_prop_ro("complete", [](const SharedMotion& self) { return self->complete; })
      .def("save", &save, nb::arg("path"), nb::arg("force") = false,
           nb::sig("def save(self, path: str | os.PathLike, force: bool = False) -> None"))
      .def("__repr__", [](const SharedMotion& self) { return motion_table(*self); });
}

}  // namespace

void add_motions(nb::module_& module) {
  add_class(module);
  module.def("play", &play, nb::arg("scene"), nb::arg("out") = nb::none(), nb::arg("set") = nb::none(),
             nb::arg("device") = nb::none(), nb::arg("force") = false, nb::arg("threads") = nb::none(),
             nb::sig("def play(scene: str | os.PathLike | tuple[str, str], out: str | os.PathLike | None = None, set: "
                     "dict[str, typing.Any] | None = None, device: str | None = None, force: bool = False, threads: "
                     "int | None = None) -> Motion"),
             "Plays the motion of a scene, as `touchfield play`. Writes its results into `out`, if given.");
  module.def(
      "read_motion",
      [](nb::handle path) {
        return computed(0, [file = path_of(path)](Progress& progress) {
          return shared(read_motion_file(file, [&](const std::string& text) { progress.warn(text); }));
        });
      },
      nb::arg("path"), nb::sig("def read_motion(path: str | os.PathLike) -> Motion"), "Reads a motion.h5.");
}

}  // namespace touchfield::python
