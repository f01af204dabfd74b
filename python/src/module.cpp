#include <algorithm>
#include <cstddef>
#include <exception>
#include <stdexcept>
#include <string>
#include <string_view>

#include <fmt/format.h>

#include "python/src/job.h"
#include "python/src/parts.h"
#include "sim/core/errors.h"
#include "sim/core/program_start.h"
#include "sim/core/renamed.h"
#include "sim/core/version.h"
#include "sim/jobs/sweep_case.h"

namespace touchfield::python {

namespace {

/// Python's names of the errors, which live as long as the process.
struct Names {
  PyObject* error = nullptr;
  PyObject* input = nullptr;
  PyObject* numerical = nullptr;
  PyObject* io = nullptr;
  PyObject* device = nullptr;
  PyObject* not_built = nullptr;
  PyObject* warning = nullptr;
  PyObject* note = nullptr;
};
Names names;

PyObject* made(nb::module_& module, const char* name, const char* doc, PyObject* base, PyObject* also = nullptr) {
  const nb::tuple bases =
      also != nullptr ? nb::make_tuple(nb::handle(base), nb::handle(also)) : nb::make_tuple(nb::handle(base));
  PyObject* type = PyErr_NewExceptionWithDoc(
      fmt::format("{}.{}", nb::cast<std::string>(module.attr("__name__")), name).c_str(), doc, bases.ptr(), nullptr);
  if (type == nullptr) {
    throw nb::python_error();
  }
  module.attr(name) = nb::borrow(type);
  return type;
}

/// Options of the program are arguments here: max_level of --max-level. Commands, in backticks, keep theirs.
std::string with_arguments(std::string text) {
  for (std::size_t at = text.find("--"); at != std::string::npos; at = text.find("--", at + 1)) {
    const auto letter = [&](std::size_t i) { return i < text.size() && text[i] >= 'a' && text[i] <= 'z'; };
    const auto ticks = std::ranges::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(at), '`');
    if (ticks % 2 == 0 && (at == 0 || std::string_view(" \n").find(text[at - 1]) != std::string_view::npos) &&
        letter(at + 2)) {
      text.erase(at, 2);
      for (std::size_t i = at; letter(i) || (i < text.size() && text[i] == '-' && letter(i + 1)); ++i) {
        text[i] = text[i] == '-' ? '_' : text[i];
      }
    }
  }
  return text;
}

/// Paths in the text may be of other bytes than UTF-8's.
void set(PyObject* type, const std::exception& caught) {
  const nb::object text = nb::steal(PyUnicode_DecodeFSDefault(with_arguments(caught.what()).c_str()));
  if (text.is_valid()) {
    PyErr_SetObject(type, text.ptr());
  }
}

void translate(const std::exception_ptr& error, void* /*payload*/) {
  try {
    std::rethrow_exception(error);
  } catch (const InputError& caught) {
    set(names.input, caught);
  } catch (const NumericalError& caught) {
    set(names.numerical, caught);
  } catch (const IoError& caught) {
    set(names.io, caught);
  } catch (const DeviceError& caught) {
    set(names.device, caught);
  } catch (const NotBuiltError& caught) {
    set(names.not_built, caught);
  } catch (const std::invalid_argument& caught) {  // of functions on plain matrices
    set(names.input, caught);
  } catch (const std::domain_error& caught) {
    set(names.numerical, caught);
  } catch (const Stopped&) {
    PyErr_SetNone(PyExc_KeyboardInterrupt);
  }
}

}  // namespace

void say(const Remark& remark) {
  PyObject* type = remark.kind == Remark::Kind::kNote ? names.note : names.warning;
  const nb::object text = nb::steal(PyUnicode_DecodeFSDefault(remark.text.c_str()));
  if (!text.is_valid()) {
    throw nb::python_error();
  }
  nb::module_::import_("touchfield._plain").attr("warn")(text, nb::borrow(type));
}

namespace {

void add_errors(nb::module_& module) {
  names.error = made(module, "Error", "Base class of all errors of touchfield.", PyExc_Exception);
  names.input = made(module, "InputError", "Wrong input that the caller can correct: a scene, a file, an argument.",
                     names.error, PyExc_ValueError);
  names.numerical =
      made(module, "NumericalError", "A computation without a reliable result.", names.error, PyExc_ArithmeticError);
  names.io = made(module, "IoError", "A file that could not be read or written although the input was right.",
                  names.error, PyExc_OSError);
  names.device =
      made(module, "DeviceError", "A device that is missing, silent or lost.", names.error, PyExc_RuntimeError);
  names.not_built =
      made(module, "NotBuiltError", "A feature that this build does not include.", names.error, PyExc_RuntimeError);
  names.warning = made(module, "TouchfieldWarning", "Anything that makes a result unreliable.", PyExc_UserWarning);
  names.note = made(module, "TouchfieldNote", "Information about a result that is reliable.", names.warning);
  nb::register_exception_translator(translate, nullptr);
}

}  // namespace

}  // namespace touchfield::python

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
  add_radiation(module);
  add_methods(module);
  add_scattering(module);
  add_runs(module);
  add_motions(module);
  add_felt(module);
  add_reports(module);
  add_emission(module);
  module.def("_report_to", &report_to, nb::arg("report").none(),
             "Sets the function that hears of the progress of this thread's computations; returns the one before.");
  module.def(
      "_new_name",
      [](const std::string& kind, const std::string& old) {
        return new_name(kind == "key" ? NameOf::kKey : kind == "argument" ? NameOf::kArgument : NameOf::kPython, old);
      },
      nb::arg("kind"), nb::arg("old"),
      "The new name of a key, argument or Python name of release 0.3; empty if it has not changed.");
  module.def("_serve_cases", &serve_cases, nb::call_guard<nb::gil_scoped_release>());
}
