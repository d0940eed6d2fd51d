#include "layfigure/app/pointer.h"

#include <gtest/gtest.h>

#include <numbers>

#include "layfigure/math/rotation.h"

namespace layfigure::app {
namespace {

constexpr double kStep = 1e-3;
constexpr double kTolerance = 1e-12;

PointerPose at(double x, double y, double z, double turn_about_z = 0.0) {
  return {{x, y, z}, math::exp_rotation({0, 0, turn_about_z})};
}

void receive(Pointer& pointer, const PointerPose& pose) {
  pointer.receive(pose, "test", pointer.sequence() + 1, 0, 50.0);
}

TEST(Pointer, WithoutGrip_FollowsMessagesAtOnce) {
  Pointer pointer;
  receive(pointer, at(1, 2, 3));
  EXPECT_EQ(pointer.pose().position, Eigen::Vector3d(1, 2, 3));
}

TEST(Pointer, Attached_TargetIsTheHeldPoint) {
  Pointer pointer;
  receive(pointer, at(1, 2, 3, 0.5));
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
  receive(pointer, at(0, 0, 0));
  pointer.attach({}, at(0, 0, 1));
  receive(pointer, at(0.3, 0, 0, 0.6));
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
  receive(pointer, at(0, 0, 0, 0.9 * std::numbers::pi));
  pointer.attach({}, at(0, 0, 0));
  receive(pointer, at(0, 0, 0, -0.9 * std::numbers::pi));
  pointer.glide(10);
  EXPECT_NEAR(pointer.aim(kStep).target_angular_velocity.z(), 0.2 * std::numbers::pi / (10 * kStep), 1e-6);
}

TEST(Pointer, NewMessageDuringAGlide_StartsWhereItIs) {
  Pointer pointer;
  receive(pointer, at(0, 0, 0));
  pointer.attach({}, at(0, 0, 0));
  receive(pointer, at(1, 0, 0));
  pointer.glide(10);
  for (int i = 0; i < 5; ++i) pointer.finish_step({});
  receive(pointer, at(0.5, 1, 0));
  pointer.glide(10);
  EXPECT_TRUE(pointer.aim(kStep).target_position.isApprox(Eigen::Vector3d(0.5, 0, 0), kTolerance));
  EXPECT_TRUE(pointer.aim(kStep).target_velocity.isApprox(Eigen::Vector3d(0, 100, 0), kTolerance));
}

TEST(PointerMessageInterval, SteadyStream_IsItsInterval) {
  Pointer pointer;
  for (int i = 1; i <= 20; ++i) pointer.receive({}, "test", i, 16 * i, 50.0);
  EXPECT_NEAR(pointer.message_interval(), 16.0, 1e-4);
}

TEST(PointerMessageInterval, BurstInASteadyStream_HardlyShortensIt) {
  Pointer pointer;
  for (int i = 1; i <= 20; ++i) pointer.receive({}, "test", i, 16 * i, 50.0);
  pointer.receive({}, "test", 21, 16 * 20, 50.0);
  EXPECT_GE(pointer.message_interval(), 8.0);
}

TEST(PointerMessageInterval, LongSilence_CountsAsTheLongest) {
  Pointer pointer;
  pointer.receive({}, "test", 1, 100000, 50.0);
  EXPECT_EQ(pointer.message_interval(), 50.0);
}

TEST(Pointer, Detached_IsAtItsNewestMessage) {
  Pointer pointer;
  receive(pointer, at(0, 0, 0));
  pointer.attach({}, at(0, 0, 0));
  receive(pointer, at(1, 0, 0));
  pointer.detach();
  EXPECT_FALSE(pointer.grip());
  EXPECT_EQ(pointer.pose().position, Eigen::Vector3d(1, 0, 0));
}

}  // namespace
}  // namespace layfigure::app
