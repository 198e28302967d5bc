// An array that is indexed by one id type only.
#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "kerf/base/check.h"

namespace kerf {

template <class Id, class T>
class IndexedArray {
 public:
  IndexedArray() = default;
  explicit IndexedArray(std::size_t n, const T& value = T()) : items_(n, value) {}
  explicit IndexedArray(std::vector<T> items) : items_(std::move(items)) {}

  T& operator[](Id id) {
    KERF_ASSERT(id.index() < items_.size());
    return items_[id.index()];
  }
  const T& operator[](Id id) const {
    KERF_ASSERT(id.index() < items_.size());
    return items_[id.index()];
  }

  Id push_back(T item) {
    items_.push_back(std::move(item));
    return Id(items_.size() - 1);
  }
  [[nodiscard]] std::size_t size() const { return items_.size(); }
  [[nodiscard]] bool empty() const { return items_.empty(); }
  [[nodiscard]] bool contains(Id id) const { return id.value >= 0 && id.index() < items_.size(); }
  void resize(std::size_t n, const T& value = T()) { items_.resize(n, value); }
  void reserve(std::size_t n) { items_.reserve(n); }
  void clear() { items_.clear(); }

  /// The plain array, for loops and bulk copies.
  std::vector<T>& raw() { return items_; }
  const std::vector<T>& raw() const { return items_; }
  auto begin() { return items_.begin(); }
  auto end() { return items_.end(); }
  auto begin() const { return items_.begin(); }
  auto end() const { return items_.end(); }
  friend bool operator==(const IndexedArray&, const IndexedArray&) = default;

 private:
  std::vector<T> items_;
};

/// The ids 0 .. n-1, for range-based loops: for (VertexId v : ids<VertexId>(mesh.positions.size())).
template <class Id>
class IdRange {
 public:
  struct Iterator {
    std::int32_t i;
    Id operator*() const { return Id(i); }
    Iterator& operator++() {
      ++i;
      return *this;
    }
    bool operator!=(const Iterator& o) const { return i != o.i; }
  };
  explicit IdRange(std::size_t n) : n_(static_cast<std::int32_t>(n)) {}
  Iterator begin() const { return {0}; }
  Iterator end() const { return {n_}; }

 private:
  std::int32_t n_;
};
template <class Id>
IdRange<Id> ids(std::size_t n) {
  return IdRange<Id>(n);
}

}  // namespace kerf
