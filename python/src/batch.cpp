#include <algorithm>
#include <variant>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <omp.h>

#include "python/src/arrays.h"
#include "python/src/job.h"
#include "python/src/parts.h"
#include "sim/batch/check_scene.h"
#include "sim/batch/sweep_list.h"
#include "sim/core/errors.h"
#include "sim/core/json_text.h"
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

nb::dict columns_of(const SweepSummary& summary) {
  const nb::object array = nb::module_::import_("numpy").attr("array");
  nb::dict columns;
  for (SweepColumn& column : sweep_columns(summary)) {
    if (std::ranges::find(summary.parameters, column.name) != summary.parameters.end()) {
      if (auto numbers = parameter_numbers(column.name, sweep_rows(summary))) {
        column.values = std::move(*numbers);
      }
    }
    columns[column.name.c_str()] = std::visit(
        [&](auto& values) -> nb::object {
          if constexpr (std::is_same_v<std::decay_t<decltype(values)>, std::vector<std::string>>) {
            return array(nb::cast(values), nb::arg("dtype") = "str");
          } else {
            return owned(std::move(values));
          }
        },
        column.values);
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
               bool /*resume*/, std::optional<int> threads, std::optional<int> number) {
  SweepOptions asked;
  asked.worker = worker();
  asked.jobs = jobs;
  asked.command_line = "touchfield.sweep() of Python";
  if (jobs < 0) {
    throw InputError(fmt::format("sweep: jobs = {} must be >= 0", jobs));
  }
  return columns_of(computed(thread_count(threads), [path = path_of(file), place = path_of(out),
                                                     overrides = overrides_of(set, device), asked,
                                                     number](Progress& progress) {
    SweepOptions options = asked;
    double done = 0;
    options.threads = omp_get_max_threads();
    options.tick = [&] { progress.advance(done); };
    SweepInput input = read_sweep_input(path, overrides);
    if (number) {
      input.shard = case_shard(*number, input.plan.cases.size());
    }
    SweepDirectory directory = input.open(place);
    share_cards(input.scenes, options);
    SweepRunner runner(input, directory, options);
    try {
      progress.begin("sweep");
      return runner
          .run([&](const SweepRecord&, const SweepProgress& now) { done = static_cast<double>(now.done) / now.cases; })
          .summary;
    } catch (const Stopped&) {
      runner.result();
      throw;
    }
  }));
}

nb::object list_sweep(nb::handle file, nb::handle set) {
  const Json cases = computed(0, [path = path_of(file), overrides = overrides_of(set, {})](Progress&) {
    Json list = Json::array();
    std::ranges::transform(list_cases(read_sweep_input(path, overrides)), std::back_inserter(list), case_value);
    return list;
  });
  return object_of(cases);
}

int sweep_cases(nb::handle file, nb::handle set) {
  return computed(0, [path = path_of(file), overrides = overrides_of(set, {})](Progress&) {
    return static_cast<int>(read_sweep(path, overrides).cases.size());
  });
}

nb::dict read_sweep_columns(nb::handle folder) {
  return columns_of(computed(0, [path = path_of(folder)](Progress&) { return collect_sweep(path).summary; }));
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
             nb::arg("device") = nb::none(), nb::arg("jobs") = 0, nb::arg("resume") = false,
             nb::arg("threads") = nb::none(), nb::arg("case") = nb::none(),
             nb::sig("def sweep(file: str | os.PathLike, out: str | os.PathLike, set: dict[str, typing.Any] | None = "
                     "None, device: str | None = None, jobs: int = 0, resume: bool = False, threads: int | None = "
                     "None, case: int | None = None) -> dict[str, numpy.typing.NDArray[typing.Any]]"),
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
