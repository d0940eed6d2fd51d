#include <LinearMath/btAlignedAllocator.h>
#include <gtest/gtest.h>

#include <cstdlib>

#include "allocation_count.h"
#include "fixture.h"

namespace layfigure::collision {
namespace {

long bullet_allocations = 0;

/// Bullet does not go through operator new.
void* count_for_bullet(std::size_t size) {
  ++bullet_allocations;
  return std::malloc(size);
}

long allocations() { return layfigure::testing::allocation_count() + bullet_allocations; }

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
  const long before = allocations();
  EXPECT_GT(wander(), 0) << "the scene must reach the search for directions";
  EXPECT_EQ(allocations() - before, 0);
}

}  // namespace
}  // namespace layfigure::collision
