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
#include "sim/jobs/check_scene.h"
#include "sim/jobs/scene_changes.h"
#include "sim/run/run_compare.h"
#include "sim/run/study.h"
#include "sim/scene/scene_reader.h"

namespace touchfield::python {

namespace {

nb::object check(nb::handle scene, nb::handle set, bool accuracy, std::optional<int> threads) {
  const Json checked = computed(thread_count(threads), [input = scene_input(scene), overrides = overrides_of(set, {}),
                                                        accuracy](Progress& progress) {
    return check_value(check_scene(input.read(overrides), accuracy, progress));
  });
  return nb::module_::import_("json").attr("loads")(json_text(checked));
}

template <class Element>
std::vector<Element> column(const Json& lines, const std::string& name) {
  std::vector<Element> values;
  std::ranges::transform(lines, std::back_inserter(values),
                         [&](const Json& line) { return line.at(name).get<Element>(); });
  return values;
}

nb::dict columns_of(const SweepSummary& summary) {
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

nb::dict sweep(nb::handle file, nb::handle out, nb::handle set, const std::optional<std::string>& device, int jobs,
               std::optional<int> threads, std::optional<int> number) {
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

nb::object list_sweep(nb::handle file, nb::handle set) {
  return object_of(computed(0, [path = path_of(file), overrides = overrides_of(set, {})](Progress&) {
    return list_cases(read_sweep_input(path, overrides));
  }));
}

int sweep_cases(nb::handle file, nb::handle set) {
  return computed(0, [path = path_of(file), overrides = overrides_of(set, {})](Progress&) {
    return static_cast<int>(read_sweep(path, overrides).cases.size());
  });
}

nb::dict read_sweep_columns(nb::handle folder) {
  return columns_of(computed(0, [path = path_of(folder)](Progress&) { return read_sweep_summary(path); }));
}

nb::list see(nb::handle scene, nb::handle out, nb::handle set, bool force, std::optional<int> threads) {
  const auto sights = computed(thread_count(threads), [input = scene_input(scene), overrides = overrides_of(set, {}),
                                                       place = path_of(out), force](Progress& progress) {
    const SeenScene seen = seen_scene(input.read(overrides), &progress);
    return filled(see_job(seen, PictureFormat::kPng), place, force, progress);
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

nb::dict fit(nb::handle folder, nb::handle out, const std::string& pose, const std::string& side, double length,
             double breadth, double edge, double learn, nb::handle workspace, bool force, std::optional<int> threads) {
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
      computed(thread_count(threads), [how, from = path_of(folder), place = path_of(out), force](Progress& progress) {
        const CameraFolder images(from, &progress);
        return filled(fit_job(images, how), place, force, progress);
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
std::vector<Value> named(const std::vector<std::string>& names, const std::map<std::string, Value>& known,
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

nb::object study(nb::handle scene, nb::handle set, const std::vector<double>& edges,
                 const std::vector<std::string>& schemes, const std::vector<std::string>& solvers,
                 const std::vector<std::string>& precisions, double rung_seconds, std::optional<int> threads) {
  std::map<std::string, Scheme> scheme_names;
  for (const Scheme scheme : all_schemes()) {
    scheme_names[to_string(scheme)] = scheme;
  }
  StudyOptions options;
  options.edges = edges;
  options.schemes = named(schemes, scheme_names, "schemes");
  options.solvers = named<SolverKind>(solvers,
                                      {{"lu", SolverKind::kLu},
                                       {"gmres", SolverKind::kGmres},
                                       {"matrix_free", SolverKind::kMatrixFree},
                                       {"fft", SolverKind::kFft}},
                                      "solvers");
  options.precisions =
      named<Precision>(precisions, {{"double", Precision::kDouble}, {"single", Precision::kSingle}}, "precisions");
  options.rung_seconds = rung_seconds;
  const Study done = computed(thread_count(threads), [input = scene_input(scene), overrides = overrides_of(set, {}),
                                                      options](Progress& progress) {
    const Scene read = input.read(overrides);
    return run_study(read, study_models(read, options), options, progress, [](const Study&) {});
  });
  Json rows = Json::array();
  std::ranges::transform(done.rungs, std::back_inserter(rows), rung_value);
  return object_of(rows);
}

nb::object compare(const SharedRun& a, const SharedRun& b) {
  const RunDifference difference =
      computed(0, [a, b](Progress&) { return compare_runs(*a, *b, scene_changes(a->scene, b->scene)); });
  Json value = difference_value(difference);
  value["text"] = describe_difference(difference);
  return object_of(value);
}

}  // namespace

void add_reports(nb::module_& module) {
  module.def("check", &check, nb::arg("scene"), nb::arg("set") = nb::none(), nb::arg("accuracy") = false,
             nb::arg("threads") = nb::none(),
             nb::sig("def check(scene: str | os.PathLike, set: dict[str, typing.Any] | None = None, accuracy: bool = "
                     "False, threads: int | None = None) -> dict[str, typing.Any]"),
             "Describes what a scene builds and costs, as `touchfield check --json`; accuracy: includes the "
             "discretisation error.");
  module.def("sweep", &sweep, nb::arg("file"), nb::arg("out"), nb::arg("set") = nb::none(),
             nb::arg("device") = nb::none(), nb::arg("jobs") = 1, nb::arg("threads") = nb::none(),
             nb::arg("case") = nb::none(),
             nb::sig("def sweep(file: str | os.PathLike, out: str | os.PathLike, set: dict[str, typing.Any] | None = "
                     "None, device: str | None = None, jobs: int = 1, threads: int | None = None, case: int | None = "
                     "None) -> dict[str, numpy.typing.NDArray[typing.Any]]"),
             "Computes the cases of a sweep, or one of them, into a folder, as `touchfield sweep`, in separate "
             "processes. Returns the columns of its table.");
  module.def("list_sweep", &list_sweep, nb::arg("file"), nb::arg("set") = nb::none(),
             nb::sig("def list_sweep(file: str | os.PathLike, set: dict[str, typing.Any] | None = None) -> "
                     "list[dict[str, typing.Any]]"),
             "Every case of a sweep and what it is expected to take, as `touchfield sweep --list --json`.");
  module.def("sweep_cases", &sweep_cases, nb::arg("file"), nb::arg("set") = nb::none(),
             nb::sig("def sweep_cases(file: str | os.PathLike, set: dict[str, typing.Any] | None = None) -> int"),
             "The number of cases of a sweep.");
  module.def("read_sweep", &read_sweep_columns, nb::arg("folder"),
             nb::sig("def read_sweep(folder: str | os.PathLike) -> dict[str, numpy.typing.NDArray[typing.Any]]"),
             "The columns of a sweep's table, for the finished cases.");
  module.def("see", &see, nb::arg("scene"), nb::arg("out"), nb::arg("set") = nb::none(), nb::arg("force") = false,
             nb::arg("threads") = nb::none(),
             nb::sig("def see(scene: str | os.PathLike | tuple[str, str], out: str | os.PathLike, set: dict[str, "
                     "typing.Any] | None = None, force: bool = False, threads: int | None = None) -> list[dict[str, "
                     "typing.Any]]"),
             "Writes the depth images of a scene's simulated cameras into a folder, as `touchfield see`.");
  const FolderFit usual;
  module.def("fit", &fit, nb::arg("folder"), nb::arg("out"), nb::kw_only(), nb::arg("pose") = "auto",
             nb::arg("side") = "auto", nb::arg("length") = usual.hand.length, nb::arg("breadth") = usual.hand.breadth,
             nb::arg("edge") = usual.edge, nb::arg("learn") = usual.learning, nb::arg("workspace") = nb::none(),
             nb::arg("force") = false, nb::arg("threads") = nb::none(),
             nb::sig("def fit(folder: str | os.PathLike, out: str | os.PathLike, *, pose: str = 'auto', side: str = "
                     "'auto', length: float = ..., breadth: float = ..., edge: float = ..., learn: float = ..., "
                     "workspace: numpy.typing.ArrayLike | None = None, force: bool = False, threads: int | None = "
                     "None) -> dict[str, typing.Any]"),
             "Fits the built-in hand to recorded depth images, as `touchfield fit`.");
  module.def("study", &study, nb::arg("scene"), nb::arg("set") = nb::none(), nb::kw_only(),
             nb::arg("edges") = std::vector<double>(), nb::arg("schemes") = std::vector<std::string>(),
             nb::arg("solvers") = std::vector<std::string>(), nb::arg("precisions") = std::vector<std::string>(),
             nb::arg("rung_seconds") = StudyOptions{}.rung_seconds, nb::arg("threads") = nb::none(),
             nb::sig("def study(scene: str | os.PathLike | tuple[str, str], set: dict[str, typing.Any] | None = None, "
                     "*, edges: list[float] = [], schemes: list[str] = [], solvers: list[str] = [], precisions: "
                     "list[str] = [], rung_seconds: float = ..., threads: int | None = None) -> list[dict[str, "
                     "typing.Any]]"),
             "Solves a scene in several ways and compares error and time, as `touchfield study`.");
  module.def("compare", &compare, nb::arg("a"), nb::arg("b"),
             nb::sig("def compare(a: Run, b: Run) -> dict[str, typing.Any]"),
             "How two runs differ, as `touchfield compare`.");
}

}  // namespace touchfield::python
