// An array indexed by the 32-bit element numbers of this module.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace kerf::mid {

template <class T>
class Column : public std::vector<T> {
 public:
  using std::vector<T>::vector;
  Column() = default;
  explicit Column(std::vector<T> items) : std::vector<T>(std::move(items)) {}
  T& operator[](std::int32_t i) { return std::vector<T>::operator[](static_cast<std::size_t>(i)); }
  const T& operator[](std::int32_t i) const { return std::vector<T>::operator[](static_cast<std::size_t>(i)); }
  [[nodiscard]] std::int32_t count() const { return static_cast<std::int32_t>(this->size()); }
};

}  // namespace kerf::mid
