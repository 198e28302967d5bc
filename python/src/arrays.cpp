#include "arrays.h"

#include <cmath>
#include <string>

#include "kerf/scene/scene_limits.h"

namespace nb = nanobind;

namespace kerf::python {
namespace {

/// Quick for what is mostly given; false: it is something else, or nothing of use.
bool take_numbers(nb::handle object, Vec3& out) {
  if (!PyTuple_Check(object.ptr()) && !PyList_Check(object.ptr())) return false;
  const Py_ssize_t size = PySequence_Size(object.ptr());
  if (size < 0) throw nb::python_error();
  if (size != 3) return false;
  for (int i = 0; i < 3; ++i) {
    const nb::object item = nb::steal(PySequence_GetItem(object.ptr(), i));
    if (!item.is_valid()) throw nb::python_error();
    if (!PyFloat_Check(item.ptr()) && (!PyLong_Check(item.ptr()) || PyBool_Check(item.ptr()))) return false;
    out[i] = PyFloat_AsDouble(item.ptr());
    if (PyErr_Occurred()) {
      PyErr_Clear();  // an integer beyond all floats
      return false;
    }
  }
  return true;
}

/// Of NumPy alone: nanobind 3.1 reads strides that other buffers need not have, as those of ctypes. Classes that derive, as masked arrays, are not
/// taken.
bool is_array(nb::handle object) {
  static PyObject* kind = nullptr;  // Python's lock guards it
  if (kind == nullptr) {
    const Call call;
    kind = nb::object(nb::module_::import_("numpy").attr("ndarray")).release().ptr();
  }
  return reinterpret_cast<PyObject*>(Py_TYPE(object.ptr())) == kind;
}

bool take_array(nb::handle object, Vec3& out) {
  if (!is_array(object)) return false;
  nb::ndarray<const double, nb::shape<3>, nb::device::cpu> array;
  if (!nb::try_cast(object, array, false)) return false;
  const auto view = array.view();
  out = {view(0), view(1), view(2)};
  return true;
}

/// What the package says of an argument that can't be taken as it is: the right words for what can't be used at all.
nb::object read_by(const char* reader, nb::handle object, const char* argument) {
  const Call call;
  return nb::module_::import_("kerf._arguments").attr(reader)(object, argument);
}

}  // namespace

std::int64_t steps_of(nb::handle object, const char* argument) {
  if (PyLong_CheckExact(object.ptr())) {
    const long long number = PyLong_AsLongLong(object.ptr());
    if (number != -1 || !PyErr_Occurred()) return number;
    PyErr_Clear();
  }
  return nb::cast<std::int64_t>(read_by("steps", object, argument));
}

bool flag_of(nb::handle object, const char* argument) {
  if (PyBool_Check(object.ptr())) return object.ptr() == Py_True;
  return nb::cast<bool>(read_by("flag", object, argument));
}

Vec3 place_of(nb::handle object, const char* argument) {
  const Vec3 place = point_of(object, argument);
  if (std::fabs(place.x) > kFarthestPlace || std::fabs(place.y) > kFarthestPlace || std::fabs(place.z) > kFarthestPlace)
    read_by("place", object, argument);
  return place;
}

Vec3 point_of(nb::handle object, const char* argument) {
  Vec3 out;
  if (!take_numbers(object, out) && !take_array(object, out)) {
    // Everything else, the right words for what can't be used included.
    const nb::object numbers = read_by("point", object, argument);
    if (!take_numbers(numbers, out)) throw nb::type_error("three numbers are wanted");
  }
  if (!is_finite(out)) throw nb::value_error((std::string(argument) + " must be finite").c_str());
  return out;
}

}  // namespace kerf::python
