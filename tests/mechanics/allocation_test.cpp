// A step in steady state allocates nothing. Counts through the replaced operator new of this test program.
#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <new>

#include "kerf/mechanics/step.h"
#include "mechanics/test_bodies.h"

#pragma GCC diagnostic ignored "-Wmismatched-new-delete"  // all of these are malloc and free

namespace {
std::atomic<long> allocations{0};

void* counted(std::size_t size, std::size_t alignment) {
  allocations.fetch_add(1, std::memory_order_relaxed);
  size = (size + alignment - 1) / alignment * alignment;
  void* p = alignment <= alignof(std::max_align_t) ? std::malloc(size) : std::aligned_alloc(alignment, size);
  if (p == nullptr) std::abort();
  return p;
}
}  // namespace

void* operator new(std::size_t size) {
  return counted(size, alignof(std::max_align_t));
}
void* operator new[](std::size_t size) {
  return counted(size, alignof(std::max_align_t));
}
void* operator new(std::size_t size, std::align_val_t a) {
  return counted(size, static_cast<std::size_t>(a));
}
void* operator new[](std::size_t size, std::align_val_t a) {
  return counted(size, static_cast<std::size_t>(a));
}
void operator delete(void* p) noexcept {
  std::free(p);
}
void operator delete[](void* p) noexcept {
  std::free(p);
}
void operator delete(void* p, std::size_t) noexcept {
  std::free(p);
}
void operator delete[](void* p, std::size_t) noexcept {
  std::free(p);
}
void operator delete(void* p, std::align_val_t) noexcept {
  std::free(p);
}
void operator delete[](void* p, std::align_val_t) noexcept {
  std::free(p);
}
void operator delete(void* p, std::size_t, std::align_val_t) noexcept {
  std::free(p);
}
void operator delete[](void* p, std::size_t, std::align_val_t) noexcept {
  std::free(p);
}

namespace kerf {
namespace {

TEST(Allocation, AStepInSteadyStateAllocatesNothing) {
  const test::Grid g{9, 9, 1};
  for (bool held : {true, false}) {
    MechanicsModel model = test::make_box(g, {0.005, 0.005, 0.005}, {});
    if (held)
      for (int y = 0; y <= 9; ++y) model.fix_node(g.node(0, y, 0), {0, 0, 0.001});
    const auto grasp = model.add_attachment(g.cell(5, 5, 0), shape_functions({}), {0.03, 0.03, 0.01}, 10);
    ASSERT_TRUE(grasp.ok());
    if (!held) model.remove_spring(grasp->id);
    MechanicsState state = rest_state(model);
    for (std::size_t i = 0; i < state.positions.size(); ++i)
      state.positions[i].z += 3 * state.positions[i].x * state.positions[i].x;
    StepWorkspace w;
    StepOptions options;
    long before = 0;
    bool two_level = false;
    for (int i = 0; i < 60; ++i) {
      if (i == 10) before = allocations.load();
      if (held) model.set_spring_target(grasp->id, {0.03, 0.03, 0.01 + 0.0001 * i});
      const Result<StepReport> report = step(model, state, options, w);
      ASSERT_TRUE(report.ok());
      two_level = two_level || report->two_level;
    }
    EXPECT_TRUE(two_level);
    EXPECT_EQ(allocations.load() - before, 0);
  }
  const long before = allocations.load();  // and the counter counts
  std::vector<int> something(100);
  EXPECT_GT(allocations.load() + static_cast<long>(something[5]), before);
}

}  // namespace
}  // namespace kerf
