// Values as bytes, and back to the bit: numbers, ids, texts, vectors, journaled arrays, and structs of them (fields.h). Bytes of padding are left out.
//
// Nothing that is read makes an array longer than its bytes can fill. A bool that is neither 0 nor 1 is refused. Ids are not: whoever reads asks
// greatest_id() and knows how many there are.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "kerf/base/fields.h"
#include "kerf/base/ids.h"
#include "kerf/base/journal.h"

namespace kerf {

static_assert(std::endian::native == std::endian::little, "the layout is that of little-endian machines");

namespace bytes {

template <class T>
struct IdTag : std::false_type {};
template <class Tag>
struct IdTag<Id<Tag>> : std::true_type {
  static constexpr char kind = 0;  ///< its address stands for the kind
};
template <class T>
struct ArrayItem : std::false_type {};
template <class T, std::size_t N>
struct ArrayItem<std::array<T, N>> : std::true_type {
  using Item = T;
};

/// What a value is made of, all the way down.
struct Inside {
  bool raw = false;      ///< of numbers, without gaps: written as it lies in memory
  bool ids = false;      ///< ids are among them
  std::size_t size = 0;  ///< bytes without gaps
};
template <class T>
constexpr Inside inside() {
  if constexpr (std::is_same_v<T, bool>) return {};  // not every byte is one
  else if constexpr (std::is_arithmetic_v<T> || std::is_enum_v<T>) return {true, false, sizeof(T)};
  else if constexpr (IdTag<T>::value) return {true, true, sizeof(T)};
  else if constexpr (ArrayItem<T>::value) {
    const Inside item = inside<typename ArrayItem<T>::Item>();
    return {item.raw, item.ids, sizeof(T)};
  } else if constexpr (std::is_trivially_copyable_v<T> && std::is_aggregate_v<T>) {
    Inside all{true, false, 0};
    T value{};
    for_each_field(value, [&all](auto& member) {
      const Inside one = inside<std::remove_cvref_t<decltype(member)>>();
      all = {all.raw && one.raw, all.ids || one.ids, all.size + one.size};
    });
    return {all.raw && all.size == sizeof(T), all.ids, sizeof(T)};
  } else {
    return {};
  }
}
template <class T>
inline constexpr Inside kInside = inside<T>();

}  // namespace bytes

/// Appends to a text.
class ByteWriter {
 public:
  explicit ByteWriter(std::string& out) : out_(&out) {}
  void raw(const void* data, std::size_t n) {
    if (n > 0) out_->append(static_cast<const char*>(data), n);
  }
  template <class T>
  void operator()(const T& value) {
    if constexpr (bytes::kInside<T>.raw) raw(&value, sizeof value);
    else if constexpr (std::is_same_v<T, bool>) (*this)(static_cast<std::uint8_t>(value ? 1 : 0));
    else for_each_field(value, *this);
  }
  template <class T, std::size_t N>
  void operator()(const std::array<T, N>& values) {
    items(values.data(), N);
  }
  template <class T>
  void operator()(const std::vector<T>& values) {
    (*this)(std::uint64_t{values.size()});
    items(values.data(), values.size());
  }
  void operator()(const std::string& text) {
    (*this)(std::uint64_t{text.size()});
    raw(text.data(), text.size());
  }
  template <class A, class B>
  void operator()(const std::pair<A, B>& pair) {
    (*this)(pair.first);
    (*this)(pair.second);
  }
  /// The items; not the log.
  template <class I, class T>
  void operator()(const Journaled<I, T>& array) {
    (*this)(array.raw());
  }

 private:
  template <class T>
  void items(const T* first, std::size_t n) {
    if constexpr (bytes::kInside<T>.raw) raw(first, n * sizeof(T));
    else
      for (std::size_t i = 0; i < n; ++i) (*this)(first[i]);
  }
  std::string* out_;
};

/// Reads what a ByteWriter has written, in the same order. After the first fault everything is as it was by default, and ok() is false.
class ByteReader {
 public:
  explicit ByteReader(std::string_view in) : in_(in) {}
  [[nodiscard]] bool ok() const { return ok_; }
  [[nodiscard]] std::size_t left() const { return in_.size(); }
  void fail() {
    ok_ = false;
    in_ = {};
  }
  /// The greatest id of a kind that has been read; -1: no valid one.
  template <class I>
  [[nodiscard]] std::int32_t greatest_id() const {
    for (const auto& [kind, id] : greatest_)
      if (kind == &bytes::IdTag<I>::kind) return id;
    return -1;
  }

  template <class T>
  void operator()(T& value) {
    if constexpr (bytes::kInside<T>.raw) raw(&value, 1);
    else if constexpr (std::is_same_v<T, bool>) {
      std::uint8_t byte = 0;
      raw(&byte, 1);
      if (byte > 1) fail();
      value = byte == 1;
    } else for_each_field(value, *this);
  }
  template <class T, std::size_t N>
  void operator()(std::array<T, N>& values) {
    items(values.data(), N);
  }
  template <class T>
  void operator()(std::vector<T>& values) {
    static_assert(!std::is_same_v<T, bool>);
    values.clear();
    const std::uint64_t n = count();
    constexpr std::size_t least = bytes::kInside<T>.raw ? sizeof(T) : 1;
    if (n > left() / least) return fail();
    if constexpr (bytes::kInside<T>.raw || least > 1) {
      values.resize(n);
      items(values.data(), values.size());
    } else {  // one by one: there may be far fewer than it says
      for (std::uint64_t i = 0; i < n && ok_; ++i) (*this)(values.emplace_back());
    }
  }
  void operator()(std::string& text) {
    text.clear();
    const std::uint64_t n = count();
    if (n > left()) return fail();
    text.assign(in_.substr(0, n));
    in_.remove_prefix(n);
  }
  template <class A, class B>
  void operator()(std::pair<A, B>& pair) {
    (*this)(pair.first);
    (*this)(pair.second);
  }
  template <class I, class T>
  void operator()(Journaled<I, T>& array) {
    std::vector<T> items;
    (*this)(items);
    array = Journaled<I, T>(std::move(items));
  }

 private:
  std::uint64_t count() {
    std::uint64_t n = 0;
    (*this)(n);
    return n;
  }
  template <class T>
  void raw(T* first, std::size_t n) {
    if (n > left() / sizeof(T)) return fail();
    if (n > 0) std::memcpy(static_cast<void*>(first), in_.data(), n * sizeof(T));
    in_.remove_prefix(n * sizeof(T));
    if constexpr (bytes::kInside<T>.ids)
      for (std::size_t i = 0; i < n; ++i) note(first[i]);
  }
  template <class T>
  void items(T* first, std::size_t n) {
    if constexpr (bytes::kInside<T>.raw) raw(first, n);
    else
      for (std::size_t i = 0; i < n && ok_; ++i) (*this)(first[i]);
  }
  template <class T>
  void note(const T& value) {
    if constexpr (bytes::IdTag<T>::value) {
      if (value.value < -1) return fail();
      for (auto& [kind, id] : greatest_)
        if (kind == &bytes::IdTag<T>::kind) {
          id = std::max(id, value.value);
          return;
        }
      greatest_.emplace_back(&bytes::IdTag<T>::kind, value.value);
    } else if constexpr (bytes::ArrayItem<T>::value) {
      if constexpr (bytes::kInside<T>.ids)
        for (const auto& one : value) note(one);
    } else if constexpr (bytes::kInside<T>.ids) {
      for_each_field(value, [this](const auto& member) { note(member); });
    }
  }

  std::string_view in_;
  std::vector<std::pair<const char*, std::int32_t>> greatest_;
  bool ok_ = true;
};

}  // namespace kerf
