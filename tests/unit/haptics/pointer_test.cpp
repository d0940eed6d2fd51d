#include "layfigure/haptics/pointer.h"

#include <gtest/gtest.h>

#include <numbers>

#include "layfigure/math/rotation.h"

namespace layfigure::haptics {
namespace {

constexpr double kStep = 1e-3;
constexpr double kTolerance = 1e-12;

PointerPose at(double x, double y, double z, double turn_about_z = 0.0) {
  return {{x, y, z}, math::exp_rotation({0, 0, turn_about_z})};
}

TEST(Pointer, WithoutGrip_FollowsMessagesAtOnce) {
  Pointer pointer;
  pointer.receive(at(1, 2, 3));
  EXPECT_EQ(pointer.pose().position, Eigen::Vector3d(1, 2, 3));
}

TEST(Pointer, Attached_TargetIsTheHeldPoint) {
  Pointer pointer;
  pointer.receive(at(1, 2, 3, 0.5));
  const PointerPose held = at(-1, 0, 7, 1.25);
  pointer.attach({}, held);
  const dynamics::Coupling& coupling = pointer.aim(kStep);
  EXPECT_TRUE(coupling.target_position.isApprox(held.position, kTolerance));
  EXPECT_LT(coupling.target_rotation.angularDistance(held.rotation), kTolerance);
  EXPECT_TRUE(coupling.target_velocity.isZero());
  EXPECT_TRUE(coupling.target_angular_velocity.isZero());
}

TEST(Pointer, AttachedBeforeAnyMessage_IsAtTheHeldPoint) {
  Pointer pointer;
  pointer.attach({}, at(4, 5, 6));
  EXPECT_EQ(pointer.pose().position, Eigen::Vector3d(4, 5, 6));
}

TEST(Pointer, Glide_MovesAtConstantVelocityAndArrivesExactly) {
  Pointer pointer;
  pointer.receive(at(0, 0, 0));
  pointer.attach({}, at(0, 0, 1));
  pointer.receive(at(0.3, 0, 0, 0.6));
  EXPECT_EQ(pointer.pose().position, Eigen::Vector3d::Zero());
  pointer.glide(3);
  for (int i = 0; i < 3; ++i) {
    const dynamics::Coupling& coupling = pointer.aim(kStep);
    EXPECT_TRUE(coupling.target_position.isApprox(Eigen::Vector3d(0.1 * i, 0, 1), kTolerance)) << i;
    EXPECT_TRUE(coupling.target_velocity.isApprox(Eigen::Vector3d(100, 0, 0), kTolerance)) << i;
    EXPECT_TRUE(coupling.target_angular_velocity.isApprox(Eigen::Vector3d(0, 0, 200), kTolerance)) << i;
    EXPECT_LT(coupling.target_rotation.angularDistance(at(0, 0, 0, 0.2 * i).rotation), 1e-7) << i;
    pointer.finish_step({});
  }
  EXPECT_EQ(pointer.pose().position, Eigen::Vector3d(0.3, 0, 0));
  EXPECT_TRUE(pointer.aim(kStep).target_velocity.isZero());
}

TEST(Pointer, GlideThroughHalfATurn_TakesTheShorterWay) {
  Pointer pointer;
  pointer.receive(at(0, 0, 0, 0.9 * std::numbers::pi));
  pointer.attach({}, at(0, 0, 0));
  pointer.receive(at(0, 0, 0, -0.9 * std::numbers::pi));
  pointer.glide(10);
  EXPECT_NEAR(pointer.aim(kStep).target_angular_velocity.z(), 0.2 * std::numbers::pi / (10 * kStep), 1e-6);
}

TEST(Pointer, NewMessageDuringAGlide_StartsWhereItIs) {
  Pointer pointer;
  pointer.receive(at(0, 0, 0));
  pointer.attach({}, at(0, 0, 0));
  pointer.receive(at(1, 0, 0));
  pointer.glide(10);
  for (int i = 0; i < 5; ++i) pointer.finish_step({});
  pointer.receive(at(0.5, 1, 0));
  pointer.glide(10);
  EXPECT_TRUE(pointer.aim(kStep).target_position.isApprox(Eigen::Vector3d(0.5, 0, 0), kTolerance));
  EXPECT_TRUE(pointer.aim(kStep).target_velocity.isApprox(Eigen::Vector3d(0, 100, 0), kTolerance));
}

TEST(Pointer, Detached_IsAtItsNewestMessage) {
  Pointer pointer;
  pointer.receive(at(0, 0, 0));
  pointer.attach({}, at(0, 0, 0));
  pointer.receive(at(1, 0, 0));
  pointer.detach();
  EXPECT_FALSE(pointer.grip());
  EXPECT_EQ(pointer.pose().position, Eigen::Vector3d(1, 0, 0));
}

TEST(Pointer, Clutched_StaysWhileItsHandMoves) {
  Pointer pointer;
  pointer.receive(at(1, 0, 0));
  pointer.attach({}, at(1, 0, 0));
  pointer.set_clutch(true);
  pointer.receive(at(5, 5, 5, 1.0));
  pointer.glide(1);
  pointer.finish_step({});
  EXPECT_EQ(pointer.pose().position, Eigen::Vector3d(1, 0, 0));
  pointer.set_clutch(false);
  pointer.receive(at(5, 5, 6, 1.0));
  pointer.glide(1);
  pointer.finish_step({});
  EXPECT_TRUE(pointer.pose().position.isApprox(Eigen::Vector3d(1, 0, 1), kTolerance));
}

TEST(Pointer, ForceOnHand_IsTheOppositeThroughTheScale) {
  Pointer pointer;
  EXPECT_TRUE(pointer.force_on_hand().force.isZero(0.0));
  pointer.receive(at(0, 0, 0));
  pointer.set_scale(0.5);
  pointer.attach({}, at(0, 0, 0));
  pointer.finish_step({.force = {2, 0, -4}, .torque = {1, 0, 0}});
  EXPECT_EQ(pointer.force_on_hand().force, Eigen::Vector3d(-1, 0, 2));
  EXPECT_EQ(pointer.force_on_hand().torque, Eigen::Vector3d(-1, 0, 0));
  pointer.set_clutch(true);
  EXPECT_TRUE(pointer.force_on_hand().force.isZero(0.0));
}

}  // namespace
}  // namespace layfigure::haptics
