// The journal: the storage layer of everything a cut changes.
//
// A Journaled array logs (index, old value) for every write to an item that existed at the last mark. One
// mechanism gives the provisional tip of a blade (roll back, walk again), refused cuts that leave no trace, and
// undo and redo of whole cuts to the bit. Ids are stable: arrays only grow, and shrink only by rolling back.
//
// A struct whose members are Journaled arrays offers for_each_array(f); the free functions below drive all its
// arrays together. No pointers, so such a struct can be copied: a copy is a snapshot.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

#include "kerf/base/check.h"

namespace kerf {

/// What take_segment took out of one array's log: enough to undo it, and then to redo it (values are swapped).
struct JournalSegment {
  std::vector<std::uint32_t> indices;
  std::vector<std::byte> values;  ///< one item per index
  std::vector<std::byte> tail;    ///< items that undo cut off
  std::size_t base_size = 0;      ///< number of items at the mark
  [[nodiscard]] std::size_t bytes() const { return indices.size() * 4 + values.size() + tail.size(); }
};

/// Array of T indexed by Id with a log of old values. T must be trivially copyable.
template <class Id, class T>
class Journaled {
  static_assert(std::is_trivially_copyable_v<T>);

 public:
  Journaled() = default;
  /// Starts with these items and an empty log.
  explicit Journaled(std::vector<T> items) : items_(std::move(items)) {}

  const T& operator[](Id id) const {
    KERF_ASSERT(id.index() < items_.size());
    return items_[id.index()];
  }
  /// The only way to write to an existing item.
  void set(Id id, const T& value) {
    KERF_ASSERT(id.index() < items_.size());
    T& item = items_[id.index()];
    if (id.index() < marked_size_) log_.push_back({static_cast<std::uint32_t>(id.index()), item});
    item = value;
  }
  Id push_back(const T& value) {
    items_.push_back(value);
    return Id(items_.size() - 1);
  }
  /// Appends n items.
  void grow(std::size_t n, const T& value = T()) { items_.resize(items_.size() + n, value); }

  [[nodiscard]] std::size_t size() const { return items_.size(); }
  [[nodiscard]] bool contains(Id id) const { return id.value >= 0 && id.index() < items_.size(); }
  [[nodiscard]] const std::vector<T>& raw() const { return items_; }
  [[nodiscard]] std::span<const T> slice(std::size_t first, std::size_t count) const {
    return std::span<const T>(items_).subspan(first, count);
  }

  /// Reserves and touches memory for `extra` more items and log entries: the page faults of first touches cost
  /// more than a cut does.
  void reserve_touched(std::size_t extra_items, std::size_t extra_log) {
    touch(items_, extra_items);
    touch(log_, extra_log);
  }

  struct Mark {
    std::size_t size = 0, log = 0;
  };

  [[nodiscard]] Mark mark() {
    marked_size_ = items_.size();
    return {items_.size(), log_.size()};
  }
  /// Back to a mark taken earlier; what came after is lost.
  void rollback(Mark to) {
    for (std::size_t i = log_.size(); i-- > to.log;) items_[log_[i].index] = log_[i].value;
    log_.resize(to.log);
    items_.resize(to.size);
    marked_size_ = to.size;
    compacted_ = 0;
  }
  /// Once the log since `from` has doubled: forgets what going back to `from` does not need, all but the first old value of every item, and
  /// items that came later. True: marks taken since `from` don't hold any more. Amortised cost: that of the writes, and a bit for
  /// each item.
  bool compact(Mark from) {
    if (log_.size() - from.log < 2 * compacted_ + from.size / 16 + 64) return false;
    std::vector<bool> seen(from.size);
    std::size_t kept = from.log;
    for (std::size_t i = from.log; i < log_.size(); ++i) {
      const Entry entry = log_[i];
      if (entry.index >= from.size || seen[entry.index]) continue;
      seen[entry.index] = true;
      log_[kept++] = entry;
    }
    log_.resize(kept);
    compacted_ = kept - from.log;
    return true;
  }
  /// Takes everything since `from` out of the log without changing items (a finished stroke becomes one undo step).
  [[nodiscard]] JournalSegment take_segment(Mark from) {
    (void)compact(from);
    JournalSegment s;
    s.base_size = from.size;
    const std::size_t n = log_.size() - from.log;
    s.indices.resize(n);
    s.values.resize(n * sizeof(T));
    for (std::size_t i = 0; i < n; ++i) {
      const Entry& entry = log_[from.log + i];
      s.indices[i] = entry.index;
      std::memcpy(s.values.data() + i * sizeof(T), static_cast<const void*>(&entry.value), sizeof(T));
    }
    compacted_ = 0;
    log_.resize(from.log);
    marked_size_ = items_.size();
    return s;
  }
  /// Undoes a segment (the latest one not yet undone); afterwards it can be redone.
  void undo(JournalSegment& s) {
    s.tail.resize((items_.size() - s.base_size) * sizeof(T));
    if (!s.tail.empty())
      std::memcpy(s.tail.data(), static_cast<const void*>(items_.data() + s.base_size), s.tail.size());
    for (std::size_t i = s.indices.size(); i-- > 0;) swap_entry(s, i);
    items_.resize(s.base_size);
    marked_size_ = items_.size();
  }
  void redo(JournalSegment& s) {
    items_.resize(s.base_size + s.tail.size() / sizeof(T));
    if (!s.tail.empty()) std::memcpy(static_cast<void*>(items_.data() + s.base_size), s.tail.data(), s.tail.size());
    for (std::size_t i = 0; i < s.indices.size(); ++i) swap_entry(s, i);
    s.tail.clear();
    marked_size_ = items_.size();
  }
  /// Indices written to since a mark (may repeat), and the first appended index: the dirty set for viewers.
  template <class F>
  void for_each_changed(Mark since, F&& f) const {
    for (std::size_t i = since.log; i < log_.size(); ++i) f(Id(static_cast<std::int32_t>(log_[i].index)));
  }
  /// The same with the value that each write replaced, oldest first: the first of an index is what it was at the mark.
  template <class F>
  void for_each_logged(Mark since, F&& f) const {
    for (std::size_t i = since.log; i < log_.size(); ++i)
      f(Id(static_cast<std::int32_t>(log_[i].index)), log_[i].value);
  }

 private:
  template <class U>
  static void touch(std::vector<U>& v, std::size_t extra) {
    const std::size_t n = v.size();
    v.resize(n + extra);  // writes every page once
    v.resize(n);
  }
  void swap_entry(JournalSegment& s, std::size_t i) {
    T old;
    std::memcpy(static_cast<void*>(&old), s.values.data() + i * sizeof(T), sizeof(T));
    std::memcpy(s.values.data() + i * sizeof(T), static_cast<const void*>(&items_[s.indices[i]]), sizeof(T));
    items_[s.indices[i]] = old;
  }
  struct Entry {
    std::uint32_t index;
    T value;
  };
  std::vector<T> items_;
  std::vector<Entry> log_;
  std::size_t marked_size_ = 0;
  std::size_t compacted_ = 0;  // entries that the last compaction left
};

// A struct of Journaled arrays offers  template <class F> void for_each_array(F&& f) { f(a); f(b); ... }
// in a fixed order; the functions below drive all its arrays together.

struct JournalMark {
  std::vector<std::pair<std::size_t, std::size_t>> arrays;  ///< (size, log length) per array
};
/// One undo step of a whole struct.
struct JournalStep {
  std::vector<JournalSegment> arrays;
  [[nodiscard]] std::size_t bytes() const {
    std::size_t sum = 0;
    for (const JournalSegment& s : arrays) sum += s.bytes();
    return sum;
  }
};

template <class Body>
void journal_mark(Body& body, JournalMark& out) {
  out.arrays.clear();
  body.for_each_array([&](auto& a) {
    const auto m = a.mark();
    out.arrays.emplace_back(m.size, m.log);
  });
}
template <class Body>
void journal_rollback(Body& body, const JournalMark& to) {
  std::size_t i = 0;
  body.for_each_array([&](auto& a) {
    a.rollback({to.arrays[i].first, to.arrays[i].second});
    ++i;
  });
}
/// Shortens long logs of a stroke that goes on. True: of the marks taken since `from`, none holds; take new ones.
template <class Body>
bool journal_compact(Body& body, const JournalMark& from) {
  std::size_t i = 0;
  bool any = false;
  body.for_each_array([&](auto& a) {
    any = a.compact({from.arrays[i].first, from.arrays[i].second}) || any;
    ++i;
  });
  return any;
}
template <class Body>
JournalStep journal_take(Body& body, const JournalMark& from) {
  JournalStep step;
  std::size_t i = 0;
  body.for_each_array([&](auto& a) {
    step.arrays.push_back(a.take_segment({from.arrays[i].first, from.arrays[i].second}));
    ++i;
  });
  return step;
}
template <class Body>
void journal_undo(Body& body, JournalStep& step) {
  std::size_t i = 0;
  body.for_each_array([&](auto& a) { a.undo(step.arrays[i++]); });
}
template <class Body>
void journal_redo(Body& body, JournalStep& step) {
  std::size_t i = 0;
  body.for_each_array([&](auto& a) { a.redo(step.arrays[i++]); });
}

}  // namespace kerf
