#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <new>

#include "layfigure/app/simulation.h"
#include "small_doll.h"

namespace {
std::atomic<long> allocations{0};
}  // namespace

// Every way to the heap that C++ code has goes through these.
void* operator new(std::size_t size) {
  ++allocations;
  if (void* memory = std::malloc(size)) return memory;
  throw std::bad_alloc();
}
void* operator new(std::size_t size, std::align_val_t alignment) {
  ++allocations;
  const auto step = static_cast<std::size_t>(alignment);
  if (void* memory = std::aligned_alloc(step, (size + step - 1) / step * step)) return memory;
  throw std::bad_alloc();
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete(void* memory, std::align_val_t) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept { std::free(memory); }

namespace layfigure::app {
namespace {

TEST(Advance, WithTwoGlidingGrips_DoesNotAllocate) {
  Simulation simulation(testing::small_doll(), {1000.0, 60.0, ClockKind::kLockstep});
  for (int id = 0; id < 2; ++id) {
    const Eigen::Vector3d held = simulation.grab({.pointer = id, .bone = 1 + id, .holds_rotation = true});
    simulation.point(id, {held + Eigen::Vector3d(0, 0, 0.1), Eigen::Quaterniond::Identity()}, "test", 1);
  }
  simulation.begin_motion(500);
  ASSERT_TRUE(simulation.advance());  // the first step with so many couplings may make room for them
  const long before = allocations;
  for (int i = 0; i < 2000; ++i) ASSERT_TRUE(simulation.advance());
  EXPECT_EQ(allocations, before);
}

}  // namespace
}  // namespace layfigure::app
