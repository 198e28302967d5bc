// Counts what a test program allocates, through its operator new, and limits it. Included by one file of a program.
#pragma once

#include <malloc.h>

#include <atomic>
#include <cstddef>
#include <cstdlib>
#include <limits>
#include <new>

#include "support/refused_new.h"

#pragma GCC diagnostic ignored "-Wmismatched-new-delete"  // all of these are malloc and free

namespace {
std::atomic<long> allocations{0};
constexpr long kNoLimit = std::numeric_limits<long>::max() / 2;
/// Bytes that can still be had; what is freed comes back.
std::atomic<long> memory_left{kNoLimit};

void give_back(void* p) {
  if (p) memory_left.fetch_add(static_cast<long>(::malloc_usable_size(p)));
  std::free(p);
}
void* counted(std::size_t size, std::size_t alignment) {
  allocations.fetch_add(1, std::memory_order_relaxed);
  if (kerf::test::refuse_request()) return nullptr;
  size = (size + alignment - 1) / alignment * alignment;
  void* p = alignment <= alignof(std::max_align_t) ? std::malloc(size) : std::aligned_alloc(alignment, size);
  if (p && memory_left.fetch_sub(static_cast<long>(::malloc_usable_size(p))) < static_cast<long>(size)) {
    give_back(p);
    return nullptr;
  }
  return p;
}
void* counted_or_throw(std::size_t size, std::size_t alignment) {
  void* p = counted(size, alignment);
  if (p == nullptr) throw std::bad_alloc();
  return p;
}
constexpr std::size_t kAlignment = alignof(std::max_align_t);
}  // namespace

void* operator new(std::size_t size) { return counted_or_throw(size, kAlignment); }
void* operator new[](std::size_t size) { return counted_or_throw(size, kAlignment); }
void* operator new(std::size_t size, std::align_val_t a) { return counted_or_throw(size, static_cast<std::size_t>(a)); }
void* operator new[](std::size_t size, std::align_val_t a) {
  return counted_or_throw(size, static_cast<std::size_t>(a));
}
void* operator new(std::size_t size, const std::nothrow_t&) noexcept { return counted(size, kAlignment); }
void* operator new[](std::size_t size, const std::nothrow_t&) noexcept { return counted(size, kAlignment); }
void* operator new(std::size_t size, std::align_val_t a, const std::nothrow_t&) noexcept {
  return counted(size, static_cast<std::size_t>(a));
}
void* operator new[](std::size_t size, std::align_val_t a, const std::nothrow_t&) noexcept {
  return counted(size, static_cast<std::size_t>(a));
}
void operator delete(void* p) noexcept { give_back(p); }
void operator delete[](void* p) noexcept { give_back(p); }
void operator delete(void* p, std::size_t) noexcept { give_back(p); }
void operator delete[](void* p, std::size_t) noexcept { give_back(p); }
void operator delete(void* p, std::align_val_t) noexcept { give_back(p); }
void operator delete[](void* p, std::align_val_t) noexcept { give_back(p); }
void operator delete(void* p, std::size_t, std::align_val_t) noexcept { give_back(p); }
void operator delete[](void* p, std::size_t, std::align_val_t) noexcept { give_back(p); }
void operator delete(void* p, const std::nothrow_t&) noexcept { give_back(p); }
void operator delete[](void* p, const std::nothrow_t&) noexcept { give_back(p); }
void operator delete(void* p, std::align_val_t, const std::nothrow_t&) noexcept { give_back(p); }
void operator delete[](void* p, std::align_val_t, const std::nothrow_t&) noexcept { give_back(p); }
