#include <LinearMath/btAlignedAllocator.h>
#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <new>

#include "fixture.h"

namespace {
std::atomic<long> allocations{0};
}  // namespace

// Every way to the heap that C++ code has goes through these; Bullet's own goes through count_for_bullet.
void* operator new(std::size_t size) {
  ++allocations;
  if (void* memory = std::malloc(size)) return memory;
  throw std::bad_alloc();
}
void* operator new(std::size_t size, std::align_val_t alignment) {
  ++allocations;
  const std::size_t align = static_cast<std::size_t>(alignment);
  if (void* memory = std::aligned_alloc(align, (size + align - 1) / align * align)) return memory;
  throw std::bad_alloc();
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete(void* memory, std::align_val_t) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept { std::free(memory); }

namespace layfigure::collision {
namespace {

void* count_for_bullet(std::size_t size) {
  ++allocations;
  return std::malloc(size);
}

TEST(World, AfterWarmUp_AllocatesNothing) {
  btAlignedAllocSetCustom(count_for_bullet, std::free);
  testing::Random random(41);
  WorldDefinition definition = testing::limbs(20);
  definition.excluded.clear();
  definition.shapes.push_back({.name = "floor", .shape = Plane{}});
  World world(definition);
  auto poses = testing::limb_poses(20, 0.09);
  const auto wander = [&] {
    int searches = 0;
    for (int k = 0; k < 300; ++k) {
      for (std::size_t i = 0; i < poses.size(); ++i) {
        poses[i].position = Eigen::Vector3d(0.15 * static_cast<double>(i), 0.0, 0.09) + 0.01 * random.direction();
        poses[i].rotation = random.rotation();
      }
      searches += world.update(poses).direction_searches;
    }
    return searches;
  };
  wander();
  const long before = allocations;
  EXPECT_GT(wander(), 0) << "the scene must reach the search for directions";
  EXPECT_EQ(allocations - before, 0);
}

}  // namespace
}  // namespace layfigure::collision
