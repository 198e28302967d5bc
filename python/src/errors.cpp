#include "errors.h"

#include <nanobind/nanobind.h>

#include "python_lock.h"

namespace nb = nanobind;

namespace kerf::python {
namespace {

void raise(const Error& error) {
  const Call call;
  try {
    const nb::object type = nb::module_::import_("kerf._error").attr("Error");
    const nb::object text =
        nb::steal(PyUnicode_DecodeUTF8(error.message.data(), static_cast<Py_ssize_t>(error.message.size()), "replace"));
    const nb::object raised = type(text, error.kind == ErrorKind::kBadInput ? "bad input" : "failed");
    PyErr_SetObject(type.ptr(), raised.ptr());
  } catch (nb::python_error& e) {
    e.restore();
  }
}

}  // namespace

void translate_failures() {
  nb::register_exception_translator([](const std::exception_ptr& thrown, void*) {
    try {
      std::rethrow_exception(thrown);
    } catch (const Failure& failure) {
      raise(failure.error());
    }
  });
}

}  // namespace kerf::python
