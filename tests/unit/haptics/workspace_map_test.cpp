#include "layfigure/haptics/workspace_map.h"

#include <gtest/gtest.h>

#include "layfigure/math/rotation.h"

namespace layfigure::haptics {
namespace {

constexpr double kTolerance = 1e-12;

PointerPose pose(const Eigen::Vector3d& position, const Eigen::Vector3d& turn = Eigen::Vector3d::Zero()) {
  return {.position = position, .rotation = math::exp_rotation(turn)};
}

void expect_same(const PointerPose& a, const PointerPose& b) {
  EXPECT_TRUE(a.position.isApprox(b.position, kTolerance)) << a.position.transpose() << " | " << b.position.transpose();
  EXPECT_LT(a.rotation.angularDistance(b.rotation), 1e-7);
}

TEST(WorkspaceMap, Untouched_IsExactlyTheHandsPose) {
  WorkspaceMap map;
  const PointerPose hand = pose({0.1, -0.7, 1.3}, {0.3, 0.2, -0.9});
  map.receive(hand);
  EXPECT_EQ(map.world().position, hand.position);
  EXPECT_EQ(map.world().rotation.coeffs(), hand.rotation.coeffs());
}

TEST(WorkspaceMap, NewScale_ScalesMotionsAndDoesNotJump) {
  WorkspaceMap map;
  map.receive(pose({0.1, 0.2, 0.3}));
  for (const double scale : {3.0, 0.25, 1.0}) {
    const PointerPose before = map.world();
    map.set_scale(scale);
    map.receive(pose({0.1, 0.2, 0.3}));
    expect_same(map.world(), before);
    map.receive(pose({0.2, 0.2, 0.3}));
    EXPECT_TRUE(map.world().position.isApprox(before.position + Eigen::Vector3d(0.1 * scale, 0, 0), kTolerance));
    map.receive(pose({0.1, 0.2, 0.3}));
  }
}

TEST(WorkspaceMap, Clutch_HoldsThePointerAndGripsAnew) {
  WorkspaceMap map;
  map.set_base(pose({1, 2, 3}, {0, 0, 0.5}));
  map.set_scale(2.0);
  map.receive(pose({0.1, 0, 0}, {0.4, 0, 0}));
  const PointerPose held = map.world();
  map.set_clutch(true);
  map.receive(pose({-0.3, 0.2, 0.1}, {-0.5, 0.2, 0}));
  expect_same(map.world(), held);
  map.set_scale(0.5);
  map.set_clutch(false);
  expect_same(map.world(), held);
  map.receive(pose({-0.3, 0.2, 0.1}, {-0.5, 0.2, 0}));
  expect_same(map.world(), held);
  // From here on the hand's turns are the pointer's, in the device's axes.
  const Eigen::Quaterniond turn = math::exp_rotation({0, 0.3, 0.1});
  PointerPose hand = pose({-0.3, 0.2, 0.1}, {-0.5, 0.2, 0});
  hand.rotation = turn * hand.rotation;
  map.receive(hand);
  const Eigen::Quaterniond base = math::exp_rotation({0, 0, 0.5});
  EXPECT_LT(map.world().rotation.angularDistance(base * turn * base.conjugate() * held.rotation), 1e-7);
}

TEST(WorkspaceMap, ClutchTurnedOffTwice_ChangesNothing) {
  WorkspaceMap map;
  map.receive(pose({0.1, 0, 0}));
  map.set_clutch(false);
  map.set_clutch(false);
  map.receive(pose({0.2, 0, 0}));
  EXPECT_EQ(map.world().position, Eigen::Vector3d(0.2, 0, 0));
}

TEST(WorkspaceMap, Base_PlacesTheDevice) {
  WorkspaceMap map;
  map.receive(pose({0.1, 0, 0}));
  map.set_base(pose({1, 2, 3}, {0, 0, 1.5707963267948966}));
  EXPECT_TRUE(map.world().position.isApprox(Eigen::Vector3d(1, 2.1, 3), kTolerance));
}

TEST(WorkspaceMap, ForceTimesMotion_IsTheSameOnBothSides) {
  WorkspaceMap map;
  map.set_base(pose({1, 2, 3}, {0.2, -0.4, 0.5}));
  map.receive(pose({0, 0, 0}));
  for (const double scale : {0.1, 1.0, 7.0}) {
    map.set_scale(scale);
    map.receive(pose({0, 0, 0}));
    const Eigen::Vector3d from = map.world().position;
    const Eigen::Vector3d moved(0.01, -0.02, 0.03);
    map.receive(pose(moved));
    const dynamics::BodyForce world{.force = {1, 2, 3}, .torque = {4, 5, 6}};
    const dynamics::BodyForce hand = map.to_hand(world);
    EXPECT_NEAR(hand.force.dot(moved), world.force.dot(map.world().position - from), 1e-12);
    EXPECT_NEAR(hand.torque.norm(), world.torque.norm(), 1e-12);
  }
}

}  // namespace
}  // namespace layfigure::haptics
