// The library's arrays as NumPy arrays, and back.
#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <cstdint>
#include <initializer_list>
#include <utility>
#include <vector>

#include "kerf/base/vec.h"
#include "python_lock.h"

namespace kerf::python {

/// A read-only NumPy array of these shape and items, which it owns from now on: nothing is copied.
template <class Scalar, class Item>
nanobind::object read_only_array(std::vector<Item> items, std::initializer_list<std::size_t> shape) {
  static_assert(sizeof(Item) % sizeof(Scalar) == 0);
  const Call call;
  items.reserve(1);  // an array of no items still wants an address
  auto* kept = new std::vector<Item>(std::move(items));
  const nanobind::capsule owner(kept, [](void* p) noexcept { delete static_cast<std::vector<Item>*>(p); });
  const auto* data = reinterpret_cast<const Scalar*>(kept->data());
  return nanobind::cast(nanobind::ndarray<nanobind::numpy, const Scalar>(data, shape, owner));
}

/// A NumPy array of these shape and items that is the caller's own: nothing is copied, and it can be written.
template <class Scalar, class Item>
nanobind::object own_array(std::vector<Item> items, std::initializer_list<std::size_t> shape) {
  static_assert(sizeof(Item) % sizeof(Scalar) == 0);
  const Call call;
  items.reserve(1);
  auto* kept = new std::vector<Item>(std::move(items));
  const nanobind::capsule owner(kept, [](void* p) noexcept { delete static_cast<std::vector<Item>*>(p); });
  auto* data = reinterpret_cast<Scalar*>(kept->data());
  return nanobind::cast(nanobind::ndarray<nanobind::numpy, Scalar>(data, shape, owner));
}

/// An array that was made of some version of what it shows.
class KeptArray {
 public:
  /// The same array while the version is the same; else a new one, and who holds the old one keeps it as it is.
  template <class Make>
  nanobind::object get(std::uint64_t version, Make&& make) {
    if (!array_.is_valid() || version != version_) {
      array_ = make();
      version_ = version;
    }
    return array_;
  }
  void forget() { array_.reset(); }

 private:
  std::uint64_t version_ = 0;
  nanobind::object array_;
};

/// A number of steps; TypeError and ValueError name the argument. Whether it may be negative is another's business.
std::int64_t steps_of(nanobind::handle object, const char* argument);
/// True or False, or NumPy's. TypeError names the argument.
bool flag_of(nanobind::handle object, const char* argument);
/// Three finite numbers of a place that is not farther away than scenes have them, metres. ValueError names the argument.
Vec3 place_of(nanobind::handle object, const char* argument);
/// Three finite numbers from a tuple, a list or an array. TypeError and ValueError name the argument.
Vec3 point_of(nanobind::handle object, const char* argument);

}  // namespace kerf::python
