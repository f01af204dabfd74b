#include <exception>
#include <stdexcept>

#include <fmt/format.h>

#include "python/src/job.h"
#include "python/src/parts.h"
#include "sim/core/errors.h"

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

/// Paths in the text may be of other bytes than UTF-8's.
void set(PyObject* type, const std::exception& caught) {
  const nb::object text = nb::steal(PyUnicode_DecodeFSDefault(caught.what()));
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

}  // namespace touchfield::python
