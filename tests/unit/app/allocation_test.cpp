#include <gtest/gtest.h>

#include "allocation_count.h"
#include "layfigure/app/simulation.h"
#include "small_doll.h"

namespace layfigure::app {
namespace {

TEST(Advance, WithTwoGlidingGrips_DoesNotAllocate) {
  Simulation simulation(testing::small_doll(), {.clock = ClockKind::kLockstep});
  for (int id = 0; id < 2; ++id) {
    const Eigen::Vector3d held = simulation.grab({.pointer = id, .bone = 1 + id, .holds_rotation = true});
    simulation.point(id, {held + Eigen::Vector3d(0, 0, 0.1), Eigen::Quaterniond::Identity()}, "test", 1);
  }
  simulation.begin_motion(500);
  ASSERT_TRUE(simulation.advance());  // the first step with so many couplings may make room for them
  const long before = testing::allocation_count();
  for (int i = 0; i < 2000; ++i) ASSERT_TRUE(simulation.advance());
  EXPECT_EQ(testing::allocation_count(), before);
}

}  // namespace
}  // namespace layfigure::app
