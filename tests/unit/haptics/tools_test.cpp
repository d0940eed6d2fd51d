#include <gtest/gtest.h>

#include <stdexcept>

#include "pinch.h"
#include "small_doll.h"

namespace layfigure::haptics {
namespace {

// The small doll's skin is a strip in the plane z = 1, from x = 0 to 0.6, 4 cm wide.
TEST(GrabWhatIsThere, PointerNearTheSkin_NamesTheBoneAndThePoint) {
  Hands hands(testing::small_doll(), kStep);
  hands.receive(0, at({0.59, 0.005, 1.01}));
  const skinning::SkinPoint there = hands.skin_near(0, kGrabReach);
  EXPECT_NEAR(there.distance, 0.01, 1e-12);
  EXPECT_TRUE(there.p_WS.isApprox(Eigen::Vector3d(0.59, 0.005, 1.0), 1e-12));
  const Eigen::Vector3d held = hands.grab({.pointer = 0, .bone = there.bone, .point = there.p_BS});
  EXPECT_TRUE(held.isApprox(there.p_WS, 1e-12));
}

TEST(GrabWhatIsThere, SkinOfABentDoll_IsWhereItIsNow) {
  Hands hands(testing::small_doll(), kStep);
  const Eigen::Vector3d held = hands.grab({.pointer = 1, .bone = 3});
  hands.receive(1, at(held));
  hands.receive(1, at(held + Eigen::Vector3d(-0.1, 0, 0.25)));
  hands.glide(500);
  run(hands, 2000);
  const Eigen::Vector3d end = hands.held_pose(*hands.pointers().at(1).grip()).position;
  ASSERT_GT(end.z(), 1.1);
  hands.receive(0, at(end));
  EXPECT_LT(hands.skin_near(0, 0.1).distance, 0.06);
  hands.receive(0, at({0.6, 0, 1.0}));
  EXPECT_THROW((void)hands.skin_near(0, 0.01), std::invalid_argument) << "it was there before";
}

TEST(GrabWhatIsThere, OutOfReachOrWithoutPose_Refused) {
  Hands hands(testing::small_doll(), kStep);
  EXPECT_THROW((void)hands.skin_near(0, 1.0), std::invalid_argument);
  hands.receive(0, at({0.3, 0, 1.05}));
  EXPECT_THROW((void)hands.skin_near(0, 0.03), std::invalid_argument);
  EXPECT_NO_THROW((void)hands.skin_near(0, 0.06));
}

TEST(GrabWhatIsThere, Ray_MeetsTheSkinOrIsRefused) {
  Hands hands(testing::small_doll(), kStep);
  const skinning::SkinPoint met = hands.skin_along({0.1, 0.005, 3}, {0, 0, -2});
  EXPECT_TRUE(met.p_WS.isApprox(Eigen::Vector3d(0.1, 0.005, 1), 1e-12));
  EXPECT_NEAR(met.distance, 2.0, 1e-12);
  EXPECT_THROW((void)hands.skin_along({0.1, 0.005, 3}, {0, 0, 1}), std::invalid_argument);
}

TEST(GrabWhatIsThere, DollWithoutSkin_Refused) {
  doll::Doll doll = testing::small_doll();
  doll.rig.meshes.clear();
  Hands hands(std::move(doll), kStep);
  hands.receive(0, at({0.3, 0, 1}));
  EXPECT_THROW((void)hands.skin_near(0, 1.0), std::invalid_argument);
}

TEST(Base, WithAToolOut_RefusedAsItWouldJump) {
  Hands hands(testing::small_doll(), kStep);
  hands.receive(0, at({0.3, 0, 1}));
  hands.set_base(0, at({0, 0, 1}));
  EXPECT_EQ(hands.pointers().at(0).pose().position, Eigen::Vector3d(0.3, 0, 2));
  hands.grab({.pointer = 0, .bone = 2});
  EXPECT_THROW(hands.set_base(0, at({0, 0, 0})), std::invalid_argument);
  EXPECT_EQ(hands.pointers().at(0).pose().position, Eigen::Vector3d(0.3, 0, 2));
}

TEST(HoldsRotation, SetDuringAGrab_HoldsItAsItIsThenAndNothingJumps) {
  Hands hands(testing::small_doll(), kStep);
  const Eigen::Vector3d held = hands.grab({.pointer = 0, .bone = 3});
  hands.receive(0,
                {.position = held, .rotation = Eigen::Quaterniond(Eigen::AngleAxisd(1.0, Eigen::Vector3d::UnitY()))});
  hands.glide(100);
  run(hands, 3000);
  const Grip& grip = *hands.pointers().at(0).grip();
  const Eigen::Quaterniond before = hands.held_pose(grip).rotation;
  EXPECT_TRUE(grip.force.torque.isZero(0.0)) << "it holds a point";
  hands.set_holds_rotation(0, true);
  run(hands, 1);
  EXPECT_LT(hands.held_pose(grip).rotation.angularDistance(before), 1e-4);
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitX()));
  const PointerPose now = hands.pointers().at(0).pose();
  hands.receive(0, {.position = now.position, .rotation = turn * now.rotation});
  hands.glide(100);
  run(hands, 1000);
  EXPECT_GT(grip.force.torque.norm(), 0.0);
  EXPECT_LT((turn * before).angularDistance(hands.held_pose(grip).rotation), before.angularDistance(turn * before));
  hands.set_holds_rotation(0, false);
  run(hands, 1);
  EXPECT_TRUE(grip.force.torque.isZero(0.0));
}

TEST(HoldsRotation, WithoutAGrab_Refused) {
  Hands hands(testing::small_doll(), kStep);
  EXPECT_THROW(hands.set_holds_rotation(0, true), std::invalid_argument);
  hands.receive(0, at({0.3, 0, 1.5}));
  hands.touch({.pointer = 0});
  EXPECT_THROW(hands.set_holds_rotation(0, true), std::invalid_argument) << "a fingertip always holds it";
}

TEST(ScaleAndClutch, WhileHolding_DoNotJump) {
  Hands hands(testing::small_doll(), kStep);
  hands.receive(0, at({0.3, 0, 1}));
  const Eigen::Vector3d held = hands.grab({.pointer = 0, .bone = 2});
  run(hands, 3000);
  const double rest = hands.pointers().at(0).grip()->force.force.norm();
  hands.set_scale(0, 5.0);
  hands.set_clutch(0, true);
  hands.receive(0, at({2, 2, 2}));
  hands.glide(10);
  run(hands, 100);
  hands.set_clutch(0, false);
  hands.receive(0, at({2, 2, 2}));
  hands.glide(10);
  run(hands, 100);
  EXPECT_NEAR(hands.pointers().at(0).grip()->force.force.norm(), rest, 1e-3);
  hands.receive(0, at({2, 2, 2.002}));  // 1 cm in the world
  hands.glide(10);
  run(hands, 2000);
  EXPECT_NEAR(hands.pointers().at(0).pose().position.z(), 1.01, 1e-9);
  EXPECT_NEAR(held.z(), 1.0, 1e-12);
}

}  // namespace
}  // namespace layfigure::haptics
