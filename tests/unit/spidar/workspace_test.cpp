#include "layfigure/spidar/workspace.h"

#include <gtest/gtest.h>

#include <numbers>

#include "devices.h"
#include "layfigure/spidar/tension_solver.h"

namespace layfigure::spidar {
namespace {

constexpr double kDegrees = std::numbers::pi / 180.0;

TEST(Reach, ForcesAndWrenchesWithinIt_CanBeHad) {
  for (const char* name : test::kDevices) {
    const Geometry geometry = test::device(name);
    const TensionSolver solver(geometry, 2.0);
    test::Dice dice(21);
    int within = 0;
    for (int trial = 0; trial < 50; ++trial) {
      const Pose pose = dice.pose(0.02, 30.0 * kDegrees);
      const Reach reach = reach_at(geometry, pose);
      if (reach.wrench == 0.0) continue;
      ++within;
      bool some_force_beyond = false;
      for (int k = 0; k < 100; ++k) {
        Wrench force = Wrench::Zero();
        force.head<3>() = dice.direction();
        EXPECT_TRUE(solver.solve(pose, 0.999 * reach.force * force).exact) << name;
        Wrench both = dice.wrench(1.0, 1.0);
        both.normalize();
        both *= 0.999 * reach.wrench;
        both.tail<3>() *= geometry.grip_radius();
        EXPECT_TRUE(solver.solve(pose, both).exact) << name;
        some_force_beyond = some_force_beyond || !solver.solve(pose, 3.0 * reach.force * force).exact;
      }
      EXPECT_TRUE(some_force_beyond) << name;
    }
    EXPECT_GT(within, 30) << name;
  }
}

TEST(Reach, TurnedFar_Ends) {
  const Geometry geometry = test::device("g6x3");
  const Reach centre = reach_at(geometry, {});
  EXPECT_TRUE(centre.wrench_closed);
  EXPECT_GT(centre.force, 3.0);
  EXPECT_GT(centre.wrench, 0.0);
  bool ended = false;
  for (double turn = 0.0; turn < 120.0; turn += 1.0) {
    const Reach reach =
        reach_at(geometry, {.rotation = math::exp_rotation(turn * kDegrees * Eigen::Vector3d::UnitZ())});
    ended = ended || reach.wrench == 0.0;
  }
  EXPECT_TRUE(ended);
}

}  // namespace
}  // namespace layfigure::spidar
