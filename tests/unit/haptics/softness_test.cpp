#include "layfigure/haptics/softness.h"

#include <gtest/gtest.h>

#include <stdexcept>

#include "pinch.h"
#include "pinched_doll.h"

namespace layfigure::haptics {
namespace {

constexpr int kHips = 0;
constexpr int kSpine = 1;
constexpr int kArm = 2;

TEST(Softness, WhileATool_IsOutOnly) {
  Hands hands(testing::thick_doll(), kStep);
  hands.set_softness(0.25);
  EXPECT_EQ(hands.state().bodies[kArm].yield_scale, 1.0);
  hands.grab({.bone = kArm});
  hands.grab({.pointer = 1, .bone = kSpine});
  EXPECT_EQ(hands.state().bodies[kArm].yield_scale, 0.25);
  hands.release(0);
  EXPECT_EQ(hands.state().bodies[kArm].yield_scale, 0.25) << "the other still holds";
  hands.set_softness(0.5);
  EXPECT_EQ(hands.state().bodies[kArm].yield_scale, 0.5);
  hands.release(1);
  for (const dynamics::BodyState& body : hands.state().bodies) EXPECT_EQ(body.yield_scale, 1.0);
}

TEST(Softness, OfOneJoint_LeavesTheOthers) {
  Hands hands(testing::thick_doll(), kStep);
  hands.set_softness(0.1, kArm);
  hands.grab({.bone = kArm});
  EXPECT_EQ(hands.state().bodies[kArm].yield_scale, 0.1);
  EXPECT_EQ(hands.state().bodies[kSpine].yield_scale, 1.0);
  hands.set_softness(2.0);
  EXPECT_EQ(hands.state().bodies[kArm].yield_scale, 2.0) << "all joints are one setting again";
}

TEST(Softness, OfABoneWithoutJoint_Refused) {
  Hands hands(testing::thick_doll(), kStep);
  EXPECT_THROW(hands.set_softness(0.1, kHips), std::invalid_argument);
  EXPECT_THROW(hands.set_softness(0.1, 3), std::invalid_argument);
}

/// How high the arm's end stays after a pull that is too little for its joint as it is.
double height_after_a_small_pull(double softness) {
  Hands hands(testing::thick_doll(), kStep);
  run(hands, 2000);
  hands.set_softness(softness);
  const Eigen::Vector3d held = hands.grab({.bone = kArm, .stiffness = 1000.0});
  hands.receive(0, at(held));
  hands.receive(0, at(held + Eigen::Vector3d(0, 0, -0.02)));
  hands.glide(300);
  run(hands, 2000);
  hands.release(0);
  run(hands, 4000);
  const Eigen::Vector3d after = hands.grab({.bone = kArm});
  return after.z() - held.z();
}

TEST(Softness, SmallPull_FindsANewPoseWhereItWouldSpringBack) {
  EXPECT_NEAR(height_after_a_small_pull(1.0), 0.0, 1e-4);
  EXPECT_LT(height_after_a_small_pull(0.5), -1e-3);
}

TEST(Softness, AfterReset_IsThatOfTheNewState) {
  Hands hands(testing::thick_doll(), kStep);
  hands.set_softness(0.25);
  hands.grab({.bone = kArm});
  hands.reset();
  EXPECT_EQ(hands.state().bodies[kArm].yield_scale, 1.0);
  hands.grab({.bone = kArm});
  EXPECT_EQ(hands.state().bodies[kArm].yield_scale, 0.25);
  hands.release(0);
  EXPECT_EQ(hands.state().bodies[kArm].yield_scale, 1.0);
}

}  // namespace
}  // namespace layfigure::haptics
