#include <algorithm>
#include <cmath>
#include <map>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <omp.h>

#include "python/src/arrays.h"
#include "python/src/job.h"
#include "python/src/parts.h"
#include "sim/cameras/fit_folder.h"
#include "sim/cameras/see_scene.h"
#include "sim/core/errors.h"
#include "sim/core/json.h"
#include "sim/core/require.h"
#include "sim/jobs/check_scene.h"
#include "sim/jobs/scene_changes.h"
#include "sim/run/run_compare.h"
#include "sim/run/study.h"
#include "sim/scene/scene_reader.h"

namespace touchfield::python {

namespace {

using RunLike = Said<"Run | str | os.PathLike">;

Rows see(const SceneLike& scene, const PathLike& out, const Changes& set, bool force, std::optional<int> threads,
         const Callback& progress) {
  const Reporting reporting(progress);
  const auto sights = computed(thread_count(threads), [input = scene_input(scene), overrides = overrides_of(set, {}),
                                                       place = path_of(out), force](Progress& task) {
    const SeenScene seen = seen_scene(input.read(overrides), &task);
    return filled(see_job(seen), place, force, task);
  });
  nb::list rows;
  for (const SightSummary& sight : sights) {
    nb::dict row;
    row["camera"] = sight.camera;
    row["pixels"] = sight.pixels;
    row["holes"] = sight.holes;
    row["nearest"] = sight.nearest;
    row["farthest"] = sight.farthest;
    rows.append(row);
  }
  return rows;
}

Values fit(const PathLike& folder, const PathLike& out, const std::string& pose, const std::string& side, double length,
           double breadth, double edge, double learn, const ArrayLike& workspace, bool force,
           std::optional<int> threads, const Callback& progress) {
  const Reporting reporting(progress);
  FolderFit how;
  how.any_pose = pose == "auto";
  how.hand.pose = how.any_pose ? HandShape{}.pose : pose;
  how.any_side = side == "auto";
  if (!how.any_side && side != "left" && side != "right") {
    throw InputError(fmt::format("fit: side = '{}' must be right, left or auto", side));
  }
  how.hand.side = side == "left" ? HandSide::kLeft : HandSide::kRight;
  how.hand.length = length;
  how.hand.breadth = breadth;
  how.edge = edge;
  how.learning = learn;
  how.workspace = MotionSpec::Sensor{}.workspace;
  if (!workspace.is_none()) {
    const Points corners = point_rows(workspace, "fit: workspace");
    require_count("fit: workspace", corners.cols(), 2, "per corner");
    how.workspace = {corners.col(0), corners.col(1)};
    if (!((how.workspace[1] - how.workspace[0]).minCoeff() > 0)) {
      throw InputError("fit: workspace: the second corner must be beyond the first in x, y and z");
    }
  }
  const FittedFolder fitted =
      computed(thread_count(threads), [how, from = path_of(folder), place = path_of(out), force](Progress& task) {
        const CameraFolder images(from, &task);
        return filled(fit_job(images, how), place, force, task);
      });
  const auto count = static_cast<Eigen::Index>(fitted.frames.size());
  std::map<const char*, Eigen::VectorXd> columns;
  for (const char* name : {"lost", "residual", "seen", "milliseconds", "landmark_off"}) {
    columns[name] = Eigen::VectorXd(count);
  }
  for (Eigen::Index f = 0; f < count; ++f) {
    const FittedFrame& frame = fitted.frames[static_cast<std::size_t>(f)];
    columns["lost"](f) = frame.fit.lost ? 1 : 0;
    columns["residual"](f) = frame.fit.lost ? kNotComputed : frame.fit.residual;
    columns["seen"](f) = frame.fit.lost ? kNotComputed : frame.fit.seen;
    columns["milliseconds"](f) = frame.milliseconds;
    columns["landmark_off"](f) = frame.landmark_off;
  }
  nb::dict frames;
  for (auto& [name, values] : columns) {
    frames[name] = owned(std::move(values));
  }
  nb::dict result;
  result["pose"] = fitted.hand.pose;
  result["side"] = side_name(fitted.hand.side);
  result["shape_learnt"] = fitted.learnt;
  result["length_ratio"] = std::exp(fitted.proportions(kLengthRatio));
  result["breadth_ratio"] = std::exp(fitted.proportions(kBreadthRatio));
  result["warnings"] = fitted.warnings;
  result["frames"] = frames;
  return result;
}

template <typename Value>
std::vector<Value> chosen(const std::vector<std::string>& names, const std::map<std::string, Value>& known,
                          const char* what) {
  std::vector<Value> values;
  for (const std::string& name : names) {
    const auto found = known.find(name);
    if (found == known.end()) {
      std::string list;
      for (const auto& [each, value] : known) {
        list += (list.empty() ? "" : ", ") + each;
      }
      throw InputError(fmt::format("study: {}: '{}' must be one of {}", what, name, list));
    }
    values.push_back(found->second);
  }
  return values;
}

Rows study(const SceneLike& scene, const Changes& set, const std::vector<double>& edges,
           const std::vector<std::string>& schemes, const std::vector<std::string>& solvers,
           const std::vector<std::string>& precisions, double rung_seconds, std::optional<int> threads,
           const Callback& progress) {
  const Reporting reporting(progress);
  std::map<std::string, Scheme> scheme_names;
  for (const Scheme scheme : all_schemes()) {
    scheme_names[to_string(scheme)] = scheme;
  }
  StudyOptions options;
  for (const double edge : edges) {
    require(edge > 0 && std::isfinite(edge), "study: edges: {:g} m must be > 0", edge);
  }
  options.edges = edges;
  options.schemes = chosen(schemes, scheme_names, "schemes");
  options.solvers = chosen<SolverKind>(solvers,
                                       {{"lu", SolverKind::kLu},
                                        {"gmres", SolverKind::kGmres},
                                        {"matrix_free", SolverKind::kMatrixFree},
                                        {"fft", SolverKind::kFft}},
                                       "solvers");
  options.precisions =
      chosen<Precision>(precisions, {{"double", Precision::kDouble}, {"single", Precision::kSingle}}, "precisions");
  options.rung_seconds = rung_seconds;
  const Study done = computed(thread_count(threads),
                              [input = scene_input(scene), overrides = overrides_of(set, {}), options](Progress& task) {
                                const Scene read = input.read(overrides);
                                return run_study(read, study_models(read, options), options, task, [](const Study&) {});
                              });
  Json rows = Json::array();
  std::ranges::transform(done.rungs, std::back_inserter(rows), rung_value);
  return object_of(rows);
}

using Columns = Said<"dict[str, numpy.typing.NDArray[typing.Any]]">;

Values check(const SceneLike& scene, const Changes& set, bool accuracy, std::optional<int> threads) {
  const Json checked = computed(thread_count(threads), [input = scene_input(scene), overrides = overrides_of(set, {}),
                                                        accuracy](Progress& progress) {
    return check_value(check_scene(input.read(overrides), accuracy, progress));
  });
  return named(nb::module_::import_("json").attr("loads")(json_text(checked)));
}

template <class Element>
std::vector<Element> column(const Json& lines, const std::string& name) {
  std::vector<Element> values;
  std::ranges::transform(lines, std::back_inserter(values),
                         [&](const Json& line) { return line.at(name).get<Element>(); });
  return values;
}

Columns columns_of(const SweepSummary& summary) {
  const nb::object array = nb::module_::import_("numpy").attr("array");
  const Json lines = sweep_lines(summary);
  const std::vector<SweepRow> rows = sweep_rows(summary);
  nb::dict columns;
  const Json columns_of_lines = sweep_columns(summary);
  for (const auto& [name, value] : columns_of_lines.items()) {
    columns[name.c_str()] = value.is_string()
                                ? array(nb::cast(column<std::string>(lines, name)), nb::arg("dtype") = "str")
                            : value.is_number_float() ? owned(column<double>(lines, name))
                                                      : owned(column<std::int64_t>(lines, name));
  }
  for (const std::string& path : summary.parameters) {
    if (auto numbers = parameter_numbers(path, rows)) {
      columns[column_of(path).c_str()] = owned(std::move(*numbers));
    }
  }
  return columns;
}

/// A process that computes cases: this interpreter, with the package from where it is now.
std::vector<std::string> worker() {
  const auto program = nb::cast<std::optional<std::string>>(nb::module_::import_("sys").attr("executable"));
  if (!program || program->empty()) {
    throw InputError("sweep: sys.executable names no Python, which computes the cases");
  }
  const nb::module_ os_path = nb::module_::import_("os.path");
  const nb::object own = os_path.attr("dirname")(nb::module_::import_("touchfield").attr("__file__"));
  const auto folder = nb::cast<std::string>(nb::repr(os_path.attr("dirname")(own)));
  return {
      *program, "-c",
      fmt::format("import sys; sys.path = [{}, *filter(None, sys.path)]; import touchfield; "  // not the current folder
                  "sys.exit(touchfield._core._serve_cases())",
                  folder)};
}

Columns sweep(const PathLike& file, const PathLike& out, const Changes& set, const std::optional<std::string>& device,
              int jobs, std::optional<int> threads, std::optional<int> number) {
  SweepOptions asked;
  asked.worker = worker();
  asked.jobs = jobs;
  asked.command_line = "touchfield.sweep() of Python";
  if (number) {
    asked.only = CaseRange{*number, *number};
  }
  if (jobs < 1) {
    throw InputError(fmt::format("sweep: jobs = {} must be >= 1", jobs));
  }
  return columns_of(computed(thread_count(threads), [path = path_of(file), place = path_of(out),
                                                     overrides = overrides_of(set, device), asked](Progress& progress) {
    SweepOptions options = asked;
    options.threads = omp_get_max_threads();
    const SweepInput input = read_sweep_input(path, overrides);
    options.cards = cards_for(input.scenes);
    progress.begin("sweep");
    return run_sweep(input, SweepDirectory::open(place, input.plan), options, progress).summary;
  }));
}

Rows list_sweep(const PathLike& file, const Changes& set) {
  return object_of(computed(0, [path = path_of(file), overrides = overrides_of(set, {})](Progress&) {
    return list_cases(read_sweep_input(path, overrides));
  }));
}

int sweep_cases(const PathLike& file, const Changes& set) {
  return computed(0, [path = path_of(file), overrides = overrides_of(set, {})](Progress&) {
    return static_cast<int>(read_sweep(path, overrides).cases.size());
  });
}

Columns read_sweep_columns(const PathLike& folder) {
  return columns_of(computed(0, [path = path_of(folder)](Progress&) { return read_sweep_summary(path); }));
}

/// A run, or that of a file.
SharedRun run_of(nb::handle run) {
  return nb::cast<SharedRun>(nb::isinstance<SharedRun>(run) ? nb::borrow(run)
                                                            : nb::module_::import_("touchfield").attr("read_run")(run));
}

Values compare(const RunLike& a, const RunLike& b) {
  const RunDifference difference = computed(
      0, [a = run_of(a), b = run_of(b)](Progress&) { return compare_runs(*a, *b, scene_changes(a->scene, b->scene)); });
  Json value = difference_value(difference);
  value["text"] = describe_difference(difference);
  return named(object_of(value));
}

}  // namespace

void add_reports(nb::module_& module) {
  module.def("see", &see, nb::arg("scene"), nb::arg("out"), nb::arg("set") = nb::none(), nb::kw_only(),
             nb::arg("force") = false, nb::arg("threads") = nb::none(), nb::arg("progress") = nb::none(),
             R"(Writes the depth images of a scene's simulated cameras into a folder, as `touchfield see`.

Parameters
----------
scene : str, os.PathLike or dict
    With `motion.sensor.cameras`.
out : str or os.PathLike
set : dict, optional
    Changes of the scene by key path.
force : bool
    Whether older images in the folder are replaced.
threads : int, optional
progress : callable or bool, optional

Returns
-------
list of dict
    Of each camera: `camera`, `pixels` per frame, `holes` (a share), `nearest` and `farthest` [m].

Examples
--------
>>> tf.see("scenes/cameras.yaml", "images")  # doctest: +SKIP
)");
  const FolderFit usual;
  module.def("fit", &fit, nb::arg("folder"), nb::arg("out"), nb::kw_only(), nb::arg("pose") = "auto",
             nb::arg("side") = "auto", nb::arg("length") = usual.hand.length, nb::arg("breadth") = usual.hand.breadth,
             nb::arg("edge") = usual.edge, nb::arg("learn") = usual.learning, nb::arg("workspace") = nb::none(),
             nb::arg("force") = false, nb::arg("threads") = nb::none(), nb::arg("progress") = nb::none(),
             R"(Fits the built-in hand to recorded depth images, as `touchfield fit`, and writes meshes over time.

Parameters
----------
folder : str or os.PathLike
    Of depth images, cameras.yaml and times.csv, as `see` writes it.
out : str or os.PathLike
    Gets meshes and tables, for ``body: {meshes: {folder, times, unit: m}}``.
pose : {"auto", "flat", "index_up", "grasp", "point_down", "fist"}
side : {"auto", "right", "left"}
length, breadth : float
    Of the hand before its shape is learnt [m].
edge : float
    Of the meshes [m].
learn : float
    Time from which the shape is learnt [s]; 0: it is not learnt.
workspace : array_like, shape (2, 3), optional
    Corners of the box in which the hand is searched [m].
force : bool
    Whether older results in the folder are replaced.
threads : int, optional
progress : callable or bool, optional

Returns
-------
dict
    `pose`, `side`, `shape_learnt`, `length_ratio`, `breadth_ratio`, `warnings`, and `frames`: columns.

Examples
--------
>>> tf.fit("images", "hand")["frames"]["residual"]  # doctest: +SKIP
)");
  module.def("study", &study, nb::arg("scene"), nb::arg("set") = nb::none(), nb::kw_only(),
             nb::arg("edges") = nb::make_tuple(), nb::arg("schemes") = nb::make_tuple(),
             nb::arg("solvers") = nb::make_tuple(), nb::arg("precisions") = nb::make_tuple(),
             nb::arg("rung_seconds") = StudyOptions{}.rung_seconds, nb::arg("threads") = nb::none(),
             nb::arg("progress") = nb::none(),
             R"(Solves a scene in several ways and compares error and time, as `touchfield study`.

Parameters
----------
scene, set
    As of `Model`.
edges : sequence of float
    Edge lengths [m]; default: 1.4, 1 and 0.7 times the scene's.
schemes, solvers, precisions : sequence of str
    Default: all.
rung_seconds : float
    Ways that are expected to take longer are skipped [s].
threads : int, optional
progress : callable or bool, optional

Returns
-------
list of dict
    A row of each way, for `pandas.DataFrame`.

Examples
--------
>>> ways = tf.study("capsule", edges=[4e-3], schemes=["burton_miller"], solvers=["lu"],
...                 precisions=["double"])
>>> ways[0]["status"]
'ok'
)");
  module.def("compare", &compare, nb::arg("a"), nb::arg("b"), R"(How two runs differ, as `touchfield compare`.

Parameters
----------
a, b : Run, str or os.PathLike
    Runs, or files of them.

Returns
-------
dict
    That of `touchfield compare --json`: `verdict` (identical, same_to_rounding, different), `largest`,
    `largest_result`, `provenance` of both, `scene` (changes by key path), `methods` (a list) and more; and `text` for
    a person.

Examples
--------
>>> run = tf.run("capsule", set={"solve.methods": ["focus"]})
>>> tf.compare(run, run)["verdict"]
'identical'
)");
  module.def("check", &check, nb::arg("scene"), nb::arg("set") = nb::none(), nb::arg("accuracy") = false,
             nb::arg("threads") = nb::none(),
             R"(Describes what a scene builds and costs, as `touchfield check --json`.

Parameters
----------
scene, set
    As of `Model`.
accuracy : bool
    Whether the discretisation error is included, which takes longer.
threads : int, optional

Examples
--------
>>> tf.check("capsule")["channels"]
256
)");
  module.def("_sweep", &sweep, nb::arg("file"), nb::arg("out"), nb::arg("set").none(), nb::arg("device").none(),
             nb::arg("jobs"), nb::arg("threads").none(), nb::arg("case") = nb::none(),
             "Computes a sweep, or its case of this number from 1.");
  module.def("_list_sweep", &list_sweep, nb::arg("file"), nb::arg("set") = nb::none());
  module.def("_sweep_cases", &sweep_cases, nb::arg("file"), nb::arg("set") = nb::none(),
             "The number of cases of a sweep.");
  module.def("_read_sweep", &read_sweep_columns, nb::arg("folder"));
}

}  // namespace touchfield::python
