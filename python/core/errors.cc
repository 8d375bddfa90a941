#include "errors.h"

#include "bind.h"

namespace agail {

namespace nb = nanobind;

namespace {

std::string text_of(const nb::python_error& error) { return nb::str(error.value()).c_str(); }

PyObject* input_error =
    nullptr;  // agail.InputError; lives as long as the module, that is, the process

}  // namespace

PythonFailure::PythonFailure(const nb::python_error& error)
    : InputError(text_of(error)),
      exception_(nb::object(nb::borrow(error.value())).release().ptr(), [](PyObject* object) {
        const nb::gil_scoped_acquire gil;
        Py_DECREF(object);
      }) {}

void PythonFailure::restore() const {
  PyErr_SetObject(reinterpret_cast<PyObject*>(Py_TYPE(exception_.get())), exception_.get());
}

void bind_errors(nb::module_& module) {
  const nb::object type = nb::steal(PyErr_NewExceptionWithDoc(
      "agail.InputError",
      "What the caller gave is wrong: one line that says what, where, and how to mend it.",
      PyExc_ValueError, nullptr));
  module.attr("InputError") = type;
  input_error = nb::object(type).release().ptr();
  nb::register_exception_translator([](const std::exception_ptr& pointer, void*) {
    try {
      std::rethrow_exception(pointer);
    } catch (const PythonFailure& failure) {
      failure.restore();
    } catch (const InputError& error) {
      PyErr_SetString(input_error, error.what());
    }
  });
}

}  // namespace agail
