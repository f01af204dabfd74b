#include <algorithm>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <omp.h>

#include "python/src/arrays.h"
#include "python/src/job.h"
#include "python/src/parts.h"
#include "sim/core/errors.h"
#include "sim/core/json.h"
#include "sim/jobs/check_scene.h"
#include "sim/jobs/sweep_list.h"
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

}  // namespace

void add_batch(nb::module_& module) {
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
}

}  // namespace touchfield::python
