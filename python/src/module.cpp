#include <nanobind/nanobind.h>
#include <nanobind/stl/string.h>
#include <string>

#include "python/src/job.h"
#include "python/src/parts.h"
#include "sim/core/program_start.h"
#include "sim/core/renamed.h"
#include "sim/core/version.h"
#include "sim/jobs/sweep_case.h"

NB_MODULE(_core, module) {
  using namespace touchfield;
  using namespace touchfield::python;
  namespace nb = nanobind;
  take_better_blas_core();
  watch_process();
  module.doc() = "The C++ library of touchfield.";
  module.attr("__version__") = build_info().version;
  module.attr("revision") = build_info().revision;
  add_errors(module);
  add_shapes(module);
  add_arrays(module);
  add_models(module);
  add_problems(module);
  add_runs(module);
  add_batch(module);
  add_motions(module);
  add_reports(module);
  add_emission(module);
  module.def("report_to", &report_to, nb::arg("report").none(),
             nb::sig("def report_to(report: typing.Callable[[str, float], object] | None) -> typing.Callable[[str, "
                     "float], object] | None"),
             "Sets the function that hears of the progress of this thread's computations; returns the one before.");
  module.def(
      "new_name",
      [](const std::string& kind, const std::string& old) {
        return new_name(kind == "key" ? NameOf::kKey : kind == "argument" ? NameOf::kArgument : NameOf::kPython, old);
      },
      nb::arg("kind"), nb::arg("old"), nb::sig("def new_name(kind: str, old: str) -> str"),
      "The new name of a key, argument or Python name of release 0.3; empty if it has not changed.");
  module.def("_serve_cases", &serve_cases, nb::call_guard<nb::gil_scoped_release>(),
             nb::sig("def _serve_cases() -> int"));
}
