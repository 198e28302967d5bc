// Renaming the items of arrays when some of them go: those that stay keep their order.
#pragma once

#include <cstdint>
#include <vector>

#include "kerf/base/journal.h"

namespace kerf {

/// New ids of the items that stay; none for those that go.
template <class Id>
class IdMap {
 public:
  IdMap() = default;
  /// keep[i] != 0: item i stays.
  explicit IdMap(const std::vector<std::uint8_t>& keep) {
    to_.reserve(keep.size());
    for (const std::uint8_t k : keep) to_.push_back(k ? kept_++ : -1);
  }
  [[nodiscard]] Id operator()(Id old) const {
    return old.valid() && old.index() < to_.size() ? Id(to_[old.index()]) : Id{};
  }
  [[nodiscard]] bool keeps(Id old) const { return (*this)(old).valid(); }
  [[nodiscard]] std::size_t old_count() const { return to_.size(); }
  [[nodiscard]] std::size_t kept_count() const { return static_cast<std::size_t>(kept_); }
  /// How many items before `old` stay: where a run that began there begins now.
  [[nodiscard]] std::int32_t kept_before(std::int32_t old) const {
    std::int32_t n = old;
    while (static_cast<std::size_t>(n) < to_.size() && to_[static_cast<std::size_t>(n)] < 0) ++n;
    return static_cast<std::size_t>(n) < to_.size() ? to_[static_cast<std::size_t>(n)] : kept_;
  }
  /// Where the ids that stay came from: the way back.
  [[nodiscard]] std::vector<Id> origins() const {
    std::vector<Id> from;
    from.reserve(kept_count());
    for (std::size_t i = 0; i < to_.size(); ++i)
      if (to_[i] >= 0) from.push_back(Id(i));
    return from;
  }

 private:
  std::vector<std::int32_t> to_;
  std::int32_t kept_ = 0;
};

/// The items of an array that stay, each as change(item) makes it. Starts an empty log.
template <class Id, class T, class Change>
void keep_items(Journaled<Id, T>& array, const IdMap<Id>& map, Change&& change) {
  std::vector<T> kept;
  kept.reserve(map.kept_count());
  for (std::size_t i = 0; i < array.size(); ++i)
    if (map.keeps(Id(i))) kept.push_back(change(array[Id(i)]));
  array = Journaled<Id, T>(std::move(kept));
}
template <class Id, class T>
void keep_items(Journaled<Id, T>& array, const IdMap<Id>& map) {
  keep_items(array, map, [](const T& item) { return item; });
}

/// A map from flags per id.
template <class Id, class Keep>
IdMap<Id> id_map(std::size_t count, Keep&& keep) {
  std::vector<std::uint8_t> flags(count);
  for (std::size_t i = 0; i < count; ++i) flags[i] = keep(Id(i)) ? 1 : 0;
  return IdMap<Id>(flags);
}

}  // namespace kerf
